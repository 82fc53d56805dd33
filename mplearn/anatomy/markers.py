"""From markers with any labels to landmarks of one body: labels say which, geometry whether.

Markers of a known set keep their names. Other labels are looked up in a table of synonyms
(`labels`); of those that may be several landmarks, the one that is as high as the marker is taken.
What lies where its landmark cannot be is left out.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence

import numpy as np

from ..body import MarkerSet, find_marker_set, human_body, marker_set
from ..body.marker_sets.marker_set import plain_name
from ..errors import BodyError
from ..option_names import option
from ..recording import FloatArray, Recording
from .body_map import BodyMap
from .facing import check_facing
from .labels import are_cut, beside_joints, landmarks_of, naming_of, without_shared_ends

SOME_FRAMES = 120  # of a recording are looked at
TRUNK, FEWEST_ON_TRUNK = ("pelvis", "abdomen", "chest", "clavicle_l", "clavicle_r"), 4
FEWEST = 6  # landmarks; fewer are no person
ON_ARMS = ("upper_arm", "forearm", "hand")
ODD = 1.6  # how many times farther apart than on a person two markers of a segment may be
ODD_BY_JOINT = 1.25  # the same for markers of two segments that a joint joins
ODD_M = 0.06  # and how much
LEVEL = 0.15  # of the stature: as high as its landmark, at most so far off
FLAT_NECK = 0.03  # of the stature: a neck no higher above the shoulders is their middle
HIGH_NECK = 0.25  # of the way from hips to shoulders: a neck farther above these is not its base
FLAT_PELVIS = 0.012  # of the stature: a pelvis farther from the middle of the hips is not that
HEADS = (0.4, 1.7)  # how far the middle of the skull is on the way to a head: to its top, or base
SHOULDERS, HIPS = ("shoulder_l", "shoulder_r"), ("hip_l", "hip_r")


def recognise_markers(recording: Recording, names: Mapping[str, str] | None = None) -> BodyMap:
    """Find the body in a recording of markers.

    Args:
        recording: Markers [m], z up.
        names: Place of the body (of the set ``"landmarks"``) by marker, for what is known better;
            "" leaves a marker out.

    Raises:
        BodyError: Too few of the labels are known, with the option that settles it.

    Example:
        >>> from mplearn.demonstrator import demonstrate
        >>> take = demonstrate(["BAR"], seed=1).recording
        >>> found = recognise_markers(take)
        >>> len(found.points) == len(take.marker_names), found.left_out
        (True, ())
    """
    names = names or {}
    labels = recording.marker_names
    some = recording.markers[:: max(1, len(recording) // SOME_FRAMES)]
    ever = np.isfinite(some).all(axis=2).sum(axis=0)
    seen = {label for label, times in zip(labels, ever, strict=True) if times}
    rest = tuple(label for label in labels if label not in names)
    if not names:
        known = _of_known_set(labels)
        if known is not None:
            return _map(labels, known, known_set=True)
    heights = _heights(labels, some)
    plain = without_shared_ends(rest)
    naming = naming_of(plain)
    read = landmarks_of(plain, naming)
    if naming == "skin":
        read = beside_joints(read, plain)
    cut = are_cut(plain)
    pairs = zip(rest, plain, strict=True)
    candidates = {label: read[short] for label, short in pairs if short in read}
    found = {label: place for label, place in names.items() if place and label in labels}
    at = {label: some[:, i] for i, label in enumerate(labels)}
    for label in _settled_first(candidates, naming, seen):
        free = [place for place in candidates[label] if place not in found.values()]
        if naming == "skin" and len(candidates[label]) > 1:
            off = {place: abs(_level(place) - _own_level(label, heights, found)) for place in free}
            free = [place for place in free if off[place] < LEVEL]
            if not cut:  # else the shortest name that begins so is likelier
                free.sort(key=off.__getitem__)
        if free:
            found[label] = _of_the_toes(free, label, found, at)
    warnings: list[str] = []
    _warn_of_others(found, labels, warnings)
    _drop_middles(found, at)
    skull = None if naming == "skin" or "skull" in names.values() else _share_of_head(found, at)
    sure = set(names) | {label for label, place in found.items() if place == "skull" and skull}
    _drop_odd(found, at, sure, warnings)
    if sum(label in seen for label in found) < FEWEST:
        raise BodyError(
            f"the markers of {recording.name!r} belong to no known set, and of their labels "
            f"({', '.join(labels[:6])}, ...) {len(found)} are known; a map file says which marker "
            f"sits where ({option('names')})"
        )
    landmarks, _ = _places()
    trunk = [body for body in landmarks.select(tuple(found.values())).bodies if body in TRUNK]
    if len(trunk) < FEWEST_ON_TRUNK:
        raise BodyError(
            f"of the markers of {recording.name!r} {len(trunk)} are known to be on pelvis, chest "
            f"and shoulders, and how the trunk stands cannot be told from fewer than "
            f"{FEWEST_ON_TRUNK}; {option('names')} says which marker sits where"
        )
    check_facing(recording.name, {place: at[label] for label, place in found.items()})
    return _map(labels, found, skull=skull, warnings=tuple(warnings))


def _of_known_set(labels: tuple[str, ...]) -> dict[str, str] | None:
    """Return the names that a known set has for its markers, or None if they are of none."""
    try:
        plain = without_shared_ends(labels)
        markers = find_marker_set(plain)
    except BodyError:
        return None
    names = {plain_name(name): name for name in markers.names}
    return {
        label: names[plain_name(short)]
        for label, short, knows in zip(labels, plain, markers.knows(plain), strict=True)
        if knows
    }


def _map(
    labels: tuple[str, ...],
    found: Mapping[str, str],
    *,
    known_set: bool = False,
    skull: float | None = None,
    warnings: tuple[str, ...] = (),
) -> BodyMap:
    points = tuple(label for label in labels if label in found)
    places = tuple(found[label] for label in points)
    parts: dict[str, tuple[str, ...]] = {
        place: (label,) for place, label in zip(places, points, strict=True)
    }
    weights = np.eye(len(points))
    if skull is not None and "skull" in places:
        row, shoulders = places.index("skull"), [places.index(place) for place in SHOULDERS]
        weights[row, [row, *shoulders]] = [skull, *(2 * [0.5 * (1.0 - skull)])]
        parts["skull"] += tuple(points[k] for k in shoulders)
    return BodyMap(
        points=points,
        places=places,
        weights=weights,
        turn=np.eye(3),
        factor=1.0,
        parts=tuple(parts.items()),
        left_out=tuple(label for label in labels if label not in found),
        stature_m=float("nan"),
        confidence=1.0 if known_set else 0.5 + 0.5 * len(points) / max(1, len(labels)),
        warnings=warnings,
    )


def _places() -> tuple[MarkerSet, FloatArray]:
    """Return the landmarks, and where they are on the upright human of 1.75 m, (M, 3) [m]."""
    landmarks, body = marker_set("landmarks"), human_body()
    places = body.tree.points(body.rest, *landmarks.attach(body.tree))
    return landmarks, places


def _level(place: str) -> float:
    """Return how high a landmark is on a person who stands, as a share of the stature."""
    landmarks, places = _places()
    return float(places[landmarks.names.index(place), 2] / human_body().height_m)


def _on_arm(place: str) -> bool:
    """Whether a landmark goes anywhere with the arm."""
    landmarks, _ = _places()
    return landmarks.bodies[landmarks.names.index(place)].startswith(ON_ARMS)


def _own_level(label: str, heights: Mapping[str, float], found: Mapping[str, str]) -> float:
    """Return how high a marker is as a share of the stature, by what is known of others.

    Where little is known, as a share of the height of the highest marker.
    """
    height = heights.get(label, 0.5)
    sure = [
        (heights[other], _level(place))
        for other, place in found.items()
        if other in heights and not _on_arm(place)
    ]
    own, levels = np.array(sure).reshape(-1, 2).T
    if len(sure) < FEWEST or np.ptp(own) < 0.5:
        return height
    return float(np.polyval(np.polyfit(own, levels, 1), height))


def _heights(labels: tuple[str, ...], some: FloatArray) -> dict[str, float]:
    """Return how high each marker is, as a share of the highest ones' height over the lowest."""
    usual = np.full(len(labels), np.nan)
    ever = ~np.isnan(some[..., 2]).all(axis=0)
    usual[ever] = np.nanmedian(some[:, ever, 2], axis=0)
    known = usual[np.isfinite(usual)]
    if not len(known):
        return {}
    low, high = known.min(), known.max()
    shares = (usual - low) / max(high - low, 1e-6)
    return {label: float(s) for label, s in zip(labels, shares, strict=True) if np.isfinite(s)}


def _warn_of_others(found: Mapping[str, str], labels: tuple[str, ...], warnings: list[str]) -> None:
    """Warn of people beside the one that was found: ``Ben:LASI`` where ``Anna:LASI`` is used."""
    subjects = {label: label.rpartition(":")[::2] for label in labels}
    used = {subjects[label][1] for label in found if subjects[label][0]}
    one = Counter(subjects[label][0] for label in found if subjects[label][0])
    others = Counter(
        subject
        for label, (subject, name) in subjects.items()
        if label not in found and name in used
    )
    people = [subject for subject, count in others.items() if subject and count >= FEWEST]
    if people:
        warnings.append(
            f"there is more than one person; {one.most_common(1)[0][0]!r} is used, and not "
            f"{', '.join(map(repr, people[:5]))} (`mplearn.mocap.each_person` makes a recording of "
            "each)"
        )


def _settled_first(
    candidates: Mapping[str, tuple[str, ...]], naming: str, seen: Collection[str]
) -> list[str]:
    """Return labels in the order in which they choose: those that mean one landmark first.

    Of joints, ``foot``, which is the ankle where nothing else is, chooses before ``toe``.
    """

    def rank(label: str) -> tuple[bool, bool, int]:
        count = len(candidates[label])
        return label not in seen, count > 1, count if naming == "skin" else -count

    return sorted(candidates, key=rank)


def _of_the_toes(
    free: Sequence[str], label: str, found: Mapping[str, str], at: Mapping[str, FloatArray]
) -> str:
    """Return the first place, or of ball and tip of the toes the one as far from the ankle."""
    side = free[0][-2:]
    toes, leg = (f"ball{side}", f"toe_tip{side}"), (f"ankle{side}", f"knee{side}")
    label_of = {place: label for label, place in found.items()}
    if tuple(free) != toes or not label_of.keys() >= set(leg):
        return free[0]
    ankle, knee = (at[label_of[place]] for place in leg)
    foot, shank = _apart(at[label], ankle), _apart(ankle, knee)
    if not (foot > 0 and shank > 0):
        return free[0]
    usual = {toe: _usual(toe, leg[0]) / _usual(*leg) for toe in toes}
    return min(toes, key=lambda toe: abs(np.log(usual[toe] * shank / foot)))


def _share_of_head(found: Mapping[str, str], at: Mapping[str, FloatArray]) -> float | None:
    """Return how far the skull's middle is on the way from the shoulders to what is called head.

    That may be the top of the neck as well as of the head. None where that cannot be told, or no
    head lies so.
    """
    where = {place: at[label] for label, place in found.items()}
    if not where.keys() >= {"skull", *SHOULDERS, *HIPS}:
        return None
    shoulders, hips = (0.5 * (where[a] + where[b]) for a, b in (SHOULDERS, HIPS))
    landmarks, places = _places()
    on_us = dict(zip(landmarks.names, places, strict=True))
    ours, our_hips = (0.5 * (on_us[a] + on_us[b]) for a, b in (SHOULDERS, HIPS))
    usual = np.linalg.norm(on_us["skull"] - ours) / np.linalg.norm(ours - our_hips)
    far = _apart(where["skull"], shoulders)
    share = float(usual * _apart(shoulders, hips) / far) if far > 0 else np.inf
    return share if HEADS[0] < share < HEADS[1] else None


def _apart(one: FloatArray, other: FloatArray) -> float:
    """Return the median distance of two points, each of shape (T, 3); NaN where never seen."""
    apart = np.linalg.norm(one - other, axis=1)
    apart = apart[np.isfinite(apart)]
    return float(np.median(apart)) if len(apart) else float("nan")


def _usual(one: str, other: str) -> float:
    """Return how far two landmarks are apart on the upright human of 1.75 m [m]."""
    landmarks, places = _places()
    a, b = (places[landmarks.names.index(name)] for name in (one, other))
    return float(np.linalg.norm(a - b))


def _drop_middles(found: dict[str, str], at: Mapping[str, FloatArray]) -> None:
    """Leave out a neck that lies between the shoulders, as pose estimators call their middle.

    Also one that is its middle or top, as depth cameras have it, and not its base; and a pelvis
    that does not lie between the hips: skeletons often begin above it.
    """
    label_of = {place: label for label, place in found.items()}
    if label_of.keys() >= {"neck", *SHOULDERS, *HIPS}:
        shoulders, hips = (
            0.5 * (at[label_of[left]] + at[label_of[right]]) for left, right in (SHOULDERS, HIPS)
        )
        neck = label_of["neck"]
        if _apart(at[neck], shoulders) > HIGH_NECK * _apart(shoulders, hips):
            del found[neck], label_of["neck"]
    for place, (left, right), middle, near in (
        ("neck", SHOULDERS, False, FLAT_NECK),
        ("pelvis", HIPS, True, FLAT_PELVIS),
    ):
        if label_of.keys() >= {place, left, right}:
            between = 0.5 * (at[label_of[left]] + at[label_of[right]])
            if (_apart(at[label_of[place]], between) < near * 1.75) != middle:
                del found[label_of[place]]


def _drop_odd(
    found: dict[str, str],
    at: Mapping[str, FloatArray],
    sure: Collection[str],
    warnings: list[str],
) -> None:
    """Leave out markers that lie too far from others of their segment to be what they are called.

    The one with most contradictions goes first, until there are none.
    """
    landmarks, places = _places()
    body_of = dict(zip(landmarks.names, landmarks.bodies, strict=True))
    place_of = dict(zip(landmarks.names, places, strict=True))
    size, near = _size(found, at, body_of, place_of), _joints()
    while True:
        odd: dict[str, int] = {}
        of = list(found)
        for i, a in enumerate(of):
            for b in of[:i]:
                one, other = body_of[found[a]], body_of[found[b]]
                if one != other and other not in near[one]:
                    continue
                apart = float(np.nanmedian(np.linalg.norm(at[a] - at[b], axis=1)))
                if one == other:
                    usual = size * float(np.linalg.norm(place_of[found[a]] - place_of[found[b]]))
                    wrong = apart > ODD * usual + ODD_M or apart < usual / ODD - ODD_M
                else:  # on segments that a joint joins: not farther apart than by way of the joint
                    joint = near[one][other]
                    bones = place_of[found[a]] - joint, place_of[found[b]] - joint
                    usual = size * float(sum(np.linalg.norm(bone) for bone in bones))
                    wrong = apart > ODD_BY_JOINT * usual + ODD_M
                if wrong:
                    odd[a], odd[b] = odd.get(a, 0) + 1, odd.get(b, 0) + 1
        odd = {label: n for label, n in odd.items() if label not in sure}
        if not odd:
            return
        worst = max(odd, key=lambda label: odd[label])
        warnings.append(
            f"{worst!r} is left out: it does not lie where {found[worst]!r} does "
            f"({option('names')} settles it)"
        )
        del found[worst]


def _joints() -> dict[str, dict[str, FloatArray]]:
    """Return, for each segment, where a joint joins it to others on the human of 1.75 m [m]."""
    body = human_body()
    origins, _ = body.tree.forward(body.rest)
    near: dict[str, dict[str, FloatArray]] = {name: {} for name in body.tree.body_names}
    for child, parent in enumerate(body.tree.parent):
        if parent >= 0:
            one, other = body.tree.body_names[child], body.tree.body_names[parent]
            near[one][other] = near[other][one] = origins[child]
    return near


def _size(
    found: Mapping[str, str],
    at: Mapping[str, FloatArray],
    body_of: Mapping[str, str],
    place_of: Mapping[str, FloatArray],
) -> float:
    """Return the person's size relative to the human of 1.75 m: median over pairs on segments."""
    of = list(found)
    ratios = [
        float(np.nanmedian(np.linalg.norm(at[a] - at[b], axis=1)))
        / float(np.linalg.norm(place_of[found[a]] - place_of[found[b]]))
        for i, a in enumerate(of)
        for b in of[:i]
        if body_of[found[a]] == body_of[found[b]]
    ]
    ratios = [ratio for ratio in ratios if np.isfinite(ratio)]
    return float(np.median(ratios)) if ratios else 1.0
