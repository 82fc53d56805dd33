"""From a skeleton of any dialect to the joints of one body.

Limbs are joints as they are. Where a segment is turned (trunk, head, hands, feet), points are set
on it where the body has them: upright, they stand as on an upright person. What upright is for a
bone, the skeleton's zero pose says where it is that of a standing person (T, A, lying on its back;
only the trunk's and the legs' shape counts), and the most upright frames elsewhere. No joint angle
of the file enters, so the order and the axes of its rotations do not matter.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..errors import BodyError
from ..mocap.people import each_person
from ..mocap.skeletons.kinematics import AXIS_MARK
from ..option_names import option
from ..recording import Recording, Skeleton
from .body_map import BodyMap
from .joint_tree import JointTree
from .likeness import likelier
from .markers import recognise_markers
from .person import Person
from .placing import Placing
from .plan import find_half, find_plan

MOST_NODES = 400  # joints at different places; the largest skeletons of people have 165 joints
SOME_FRAMES = 120  # of a recording are looked at


def recognise_skeleton(recording: Recording, names: Mapping[str, str] | None = None) -> BodyMap:
    """Find the body in a recording of joint positions.

    Args:
        recording: Joint positions with their skeleton, best with the joints' axes
            (`Hints.joint_axes`).
        names: Place of the body by joint, for what is known better; "" leaves a joint out.

    Raises:
        BodyError: There is no body in it, or left and right cannot be told apart, with the reason.

    Example:
        >>> import numpy as np
        >>> from mplearn.body import human_body
        >>> from mplearn.recording import Skeleton, marker_channels
        >>> tree = human_body().tree
        >>> names, place = tree.body_names, tree.forward(tree.rest)[0]  # (J, 3) [m]
        >>> offsets = np.vstack((place[0], place[1:] - place[tree.parent[1:]]))
        >>> skeleton = Skeleton(names, tuple(tree.parent), offsets)
        >>> frames = np.tile(place.ravel(), (50, 1))  # somebody stands there
        >>> take = Recording(frames, 50.0, marker_channels(names), skeleton=skeleton)
        >>> abs(recognise_skeleton(take).stature_m - 1.75) < 0.05
        True
    """
    skeleton = recording.skeleton
    if skeleton is None:
        raise BodyError(f"recording {recording.name!r} has no skeleton")
    body, axes = _without_axes(skeleton)
    some = recording.markers[:: max(1, len(recording) // SOME_FRAMES)]
    some = some[np.isfinite(some).all(axis=(1, 2))]
    if not len(some):
        raise BodyError(f"recording {recording.name!r} has no frame in which all joints are known")
    tree = JointTree.of(body, some[:, : len(body)])
    small = len(tree) <= MOST_NODES
    plan, half = (find_plan(tree), find_half(tree)) if small else (None, None)
    if plan is None and half is None:
        if names:
            return recognise_markers(recording, names)
        some_names = ", ".join([*body.names[:6], *(["..."] if len(body) > 6 else [])])
        raise BodyError(
            f"no body in the skeleton of {recording.name!r} ({len(body)} joints: {some_names}"
            "): two legs and two arms were not found among its branches, and none that are "
            f"named so; {option('names')} says which joint is which"
        )
    report = recording.report
    doubt = report is None or report.up_in_doubt
    unit_m = (report.unit_m if report else None) or 1.0
    chosen = likelier(recording.name, tree, plan, half, sure=bool(names))
    person = Person(recording.name, tree, chosen, names or {}, unit_m=unit_m, up_in_doubt=doubt)
    people = [each.person for each in each_person(recording)]
    if len(people) > 1:
        person.warnings.append(
            f"there is more than one person ({', '.join(people)}), and one is used "
            "(`mplearn.mocap.each_person` makes a recording of each)"
        )
    return Placing(person, skeleton, some, axes).map(names or {})


def _without_axes(skeleton: Skeleton) -> tuple[Skeleton, dict[int, tuple[int, int, int]]]:
    """Return the skeleton without points that show axes, and those of each joint."""
    marked = [
        name.endswith(tuple(f"{AXIS_MARK}{axis}" for axis in "xyz")) for name in skeleton.names
    ]
    n = marked.index(True) if True in marked else len(marked)
    axes: dict[int, tuple[int, int, int]] = {}
    for first in range(n, len(marked), 3):
        axes[skeleton.parents[first]] = (first, first + 1, first + 2)
    plain = Skeleton(
        skeleton.names[:n], skeleton.parents[:n], skeleton.offsets[:n], skeleton.ends[:n]
    )
    return plain, axes
