"""What names of joints say about side and part: hints, which settle what geometry leaves open."""

from __future__ import annotations

from collections.abc import Sequence

# a pair of names says which is the left one if exchanging these words turns one into the other
_SIDES = (
    ("left", "right"),
    ("lft", "rgt"),
    ("links", "rechts"),
    ("gauche", "droite"),
    ("izquierda", "derecha"),
    ("izq", "der"),
    ("gauche", "droit"),
    ("sinistr", "destr"),
    ("esquerd", "direit"),
    ("лев", "прав"),
    ("左", "右"),
    ("왼", "오른"),
    ("li", "re"),
    ("l", "r"),
)
_LEG = ("leg", "thigh", "femur", "knee", "shin", "tibia", "shank", "calf", "foot", "ankle", "toe")
_ARM = ("arm", "hand", "elbow", "wrist", "clavicle", "collar", "humerus", "radius", "finger")
_HEAD = ("head", "neck", "skull", "nose", "eye", "jaw")


def left_of_pair(first: Sequence[str], second: Sequence[str]) -> int:
    """Say which of two groups of names is the left one.

    Args:
        first: Names of one limb's joints.
        second: Names of the other limb's joints, in the same order.

    Returns:
        1 if the first is the left one, -1 if it is the right one, 0 if the names do not say.
    """
    votes = [
        1 if _exchanged(a.lower(), b.lower()) else -1 if _exchanged(b.lower(), a.lower()) else 0
        for a, b in zip(first, second, strict=False)
    ]
    total = sum(votes)
    return (total > 0) - (total < 0)


def sides_of(names: Sequence[str]) -> list[int]:
    """Return 1 for each name that is the left one of a pair, -1 for the right one, 0 for others.

    Example:
        >>> sides_of(["Hip", "LThigh", "RThigh", "LHand"])
        [0, 1, -1, 0]
    """
    small = [name.lower() for name in names]
    sides = [0] * len(names)
    for k, left in enumerate(small):
        for j, right in enumerate(small):
            if j != k and _exchanged(left, right):
                sides[k], sides[j] = 1, -1
    return sides


def _exchanged(left: str, right: str) -> bool:
    """Whether a word for left in one name is a word for right at the same place in the other."""
    for l_word, r_word in _SIDES:
        at = left.find(l_word)
        while at >= 0:
            if left[:at] + r_word + left[at + len(l_word) :] == right:
                return True
            at = left.find(l_word, at + 1)
    return False


def says_leg(names: Sequence[str]) -> int:
    """Return 1 for names of a leg, -1 for names of an arm, 0 for neither or both."""
    legs = sum(any(word in name.lower() for word in _LEG) for name in names)
    arms = sum(any(word in name.lower().replace("_", "") for word in _ARM) for name in names)
    return (legs > arms) - (legs < arms)


def says_neck(names: Sequence[str]) -> bool:
    """Whether names are those of a neck."""
    return any("neck" in name.lower() for name in names)


def says_head(names: Sequence[str]) -> bool:
    """Whether names are those of a head and a neck."""
    return any(word in name.lower() for name in names for word in _HEAD)
