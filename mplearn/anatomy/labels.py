"""Labels of markers: a side and a stem, whatever the spelling.

``R.Knee.Medial``, ``RKNM`` and ``R_FME`` are all the inner side of the right knee.
"""

from __future__ import annotations

import re
from itertools import chain
from typing import Literal, NamedTuple

from ..mocap.markers.names import WORD_MARKS, shared_start
from .synonyms import (
    BONES_MIDDLE,
    BONES_SIDED,
    JOINTS_MIDDLE,
    JOINTS_SIDED,
    SKIN_MIDDLE,
    SKIN_SIDED,
)

_SIDES = frozenset(("l", "r", "left", "right"))
CUT = 4  # letters that some files keep of a label
_PELVIS = frozenset(("iliac_front", "iliac_back", "trochanter"))
_LIMBS = frozenset(("elbow", "hip", "knee"))  # called by others where joints are called as bones
Naming = Literal["skin", "joints", "bones"]
_TABLES: dict[Naming, tuple[dict[str, str], dict[str, str]]] = {
    "skin": (SKIN_SIDED, SKIN_MIDDLE),
    "joints": (JOINTS_SIDED, JOINTS_MIDDLE),
    "bones": (BONES_SIDED, BONES_MIDDLE),
}


class Label(NamedTuple):
    """What a label says.

    Attributes:
        stem: The label without its side, in small letters and digits.
        side: ``"l"``, ``"r"`` or empty.
    """

    stem: str
    side: str


def read_label(label: str) -> list[Label]:
    """Return the ways to read a label, the likeliest first."""
    plain = re.split(r"[:|]", label)[-1].strip()
    spaced = re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", " ", plain)
    words = [word for word in re.split(r"[^a-z0-9]+", spaced.lower()) if word]
    ways: list[Label] = []
    ends = (0, len(words) - 1) if len(words) > 1 else ()
    for at in dict.fromkeys((*ends, *range(len(words)))):
        side = {"l": "l", "left": "l", "r": "r", "right": "r"}.get(words[at], "")
        if side and len(words) > 1:
            ways.append(Label("".join(words[:at] + words[at + 1 :]), side))
    joined = "".join(words)
    for word, side in (("left", "l"), ("right", "r")):
        if joined.startswith(word):
            ways.append(Label(joined[len(word) :], side))
        elif joined.endswith(word):
            ways.append(Label(joined[: -len(word)], side))
        elif word in joined:
            ways.append(Label(joined.replace(word, "", 1), side))
    if joined[:1] in ("l", "r") and len(joined) > 1:
        ways.append(Label(joined[1:], joined[0]))
    if joined[-1:] in ("l", "r") and len(joined) > 1:
        ways.append(Label(joined[:-1], joined[-1]))
    ways.append(Label(joined, ""))
    return list(dict.fromkeys(ways))


def without_shared_ends(labels: tuple[str, ...]) -> tuple[str, ...]:
    """Return labels without what all begin and end with; a side stays.

    As ``Skeleton_001_`` of Motive, or the name of a trial behind each label.
    """
    for start, end in ((shared_start(labels), ""), ("", _shared_end(labels))):
        words = set(re.split(f"[{re.escape(WORD_MARKS)}]+", (start + end).lower()))
        named = tuple(label[len(start) : len(label) - len(end)] for label in labels)
        if not words & _SIDES and all(name[:1].isalpha() for name in named):
            labels = named
    return labels


def _shared_end(labels: tuple[str, ...]) -> str:
    return shared_start([label[::-1] for label in labels])[::-1]


def landmarks_of(labels: tuple[str, ...], naming: Naming) -> dict[str, tuple[str, ...]]:
    """Return the landmarks that each label may name, mostly one; labels of none are left out.

    Where labels were cut to four letters, a label may begin the names of several landmarks.

    Args:
        labels: Names of markers.
        naming: How they are named; see `naming_of`.
    """
    sided, middle = map(_lookup, _TABLES[naming])
    cut, lateral = are_cut(labels), _lateral(labels)
    found: dict[str, tuple[str, ...]] = {}
    for label in labels:
        ways = [
            (stem, side, sided if side else middle)
            for stem, side in read_label(label)
            if not (side == "l" and stem.endswith(label[-3:-1].lower()) and label in lateral)
        ]
        ways.sort(key=lambda way: bool(way[1]))  # "Rear" is no right ear
        exact = [_sided(table[stem], side) for stem, side, table in ways if stem in table]
        if exact and not (cut and len(label) == CUT and not label.isalnum()):
            found[label] = exact[0]
        elif cut:
            begun = [
                (len(known), _sided(names, side))
                for stem, side, table in ways
                if len(stem) >= 2
                for known, names in table.items()
                if known.startswith(stem)
            ]
            if begun:  # the shortest name first: "To" is a toe rather than "ToeTip"
                begun.sort(key=lambda found: found[0])
                found[label] = tuple(dict.fromkeys(chain(*(names for _, names in begun))))
    return found


def _lateral(labels: tuple[str, ...]) -> frozenset[str]:
    """Return labels whose last letter, l, is no side: ``ARMl`` is beside ``ARMm``, not ``ARMr``."""
    small = {label.lower() for label in labels}
    return frozenset(
        label
        for label in labels
        if label[-1:] in ("l", "L")
        and label[:-1].lower() + "m" in small
        and label[:-1].lower() + "r" not in small
    )


def are_cut(labels: tuple[str, ...]) -> bool:
    """Whether labels may have been cut to four letters."""
    return max(map(len, labels), default=0) <= CUT


def beside_joints(
    read: dict[str, tuple[str, ...]], labels: tuple[str, ...]
) -> dict[str, tuple[str, ...]]:
    """Return what labels of skin name where joints are beside them, as OpenCap has both.

    Of two labels that name one landmark (``RKnee``, ``r_knee_study``), the one that pose estimators
    call a joint is that joint; so are, then, all that are called so (``RHip``, ``RWrist``).
    """
    joints = landmarks_of(labels, "joints")
    claims: dict[tuple[str, ...], list[str]] = {}
    for label, places in read.items():
        claims.setdefault(places, []).append(label)
    contested = {
        label
        for places, rivals in claims.items()
        for label in rivals
        if joints.get(label, places) != places and any(r not in joints for r in rivals)
    }
    return read | joints if len(contested) >= len(_LIMBS) else read


def _sided(names: tuple[str, ...], side: str) -> tuple[str, ...]:
    return tuple(f"{name}_{side}" for name in names) if side else names


def naming_of(labels: tuple[str, ...]) -> Naming:
    """Return how labels are named, by what they tell of the pelvis and of the limbs.

    ``"skin"``: as markers, ``LASI``; ``"joints"``: as pose estimators have them, ``LHip``,
    ``LElbow``; ``"bones"``: joints that are called after the bone below, ``LeftUpLeg``,
    ``LeftForeArm``.
    """
    if names_skin(labels):
        return "skin"
    stems = {stem for label in labels for stem, side in read_label(label) if side}
    joints, bones = _lookup(JOINTS_SIDED), _lookup(BONES_SIDED)
    called_joints = any(joints.get(stem, ("",))[0] in _LIMBS for stem in stems - bones.keys())
    called_bones = {bones[stem][0] for stem in stems & bones.keys()}
    if called_bones >= _LIMBS and not called_joints:
        return "bones"
    return "joints" if stems & {"hip", "hjc", "upleg"} else "skin"


def names_skin(labels: tuple[str, ...]) -> bool:
    """Whether labels name points of the pelvis' skin, as those of markers do."""
    ways = [way for label in labels for way in read_label(label)]
    skin = _lookup(SKIN_SIDED)
    return any(side and not _PELVIS.isdisjoint(skin.get(stem, ())) for stem, side in ways)


def _lookup(table: dict[str, str]) -> dict[str, tuple[str, ...]]:
    found: dict[str, tuple[str, ...]] = {}
    for name, stems in table.items():
        for stem in stems.split():
            found[stem] = (*found.get(stem, ()), name)
    return found
