"""What names of markers and joints tell about where they sit on a body: hints, never more.

A name counts by what it contains, whatever the spelling: ``L_FCC``, ``LHEE``, ``Left Heel``,
``LeftToeBase``. Shares of the stature follow [Winter2009, Figure 4.1].
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache

# The first that is found counts: arms and hands before all that their names contain ("forearm"
# holds an ear, a metacarpal "met").
_PARTS = (
    ("elbow", r"elb|fore_?arm|lower_?arm|hl?me|hle|radius$"),
    ("wrist", r"wri|wr[ab]?$|(?:left|right|^l_?|^r_?)hand$|radstyl|ulnstyl"),
    ("arm", r"arm|hand|finger|fin$|thumb|index|pinky|ring\d|frm|upa|bic|rad|uln|hm[125]|mcp|"
            r"metacarp|humer"),
    ("toe", r"toe|hallux|fm[125]|mt[1-5]|mth|metatars|d[1-5]m|foot_?index"),
    ("heel", r"hee(?!d)|heel|fcc|calc"),
    ("ankle", r"ank|ankle|fal|tam|mal(?:l|$)|mmal|lmal|foot|talus"),
    ("thigh", r"thi|uppe?r?_?leg|upleg|lthi|femur"),
    ("shank", r"tib|shank|shin|shn|lower_?leg|lowleg|calf"),
    ("knee", r"kne|fle$|fme$|(?:left|right|^l_?|^r_?)leg"),
    ("pelvis", r"asi|psi|hip|pelv|ias$|ips$|sacr|[fb]wt|^root|trochant|iliac|waist"),
    ("head", r"head|[fb]?hd$|hd\d?$|nose|eye|ear(?!m)|mouth|vertex|ariel|jaw"),
    ("shoulder", r"sho|clav|acr|collar|neck|^c7|cv7|^sj?n?$|manub|ijn?$"),
    ("trunk", r"(?<![a-z])t\d+$|tv\d|^l[1-5]$|strn|stern|spine|chest|thorax|back|rbak|rbac|abdom|"
              r"torso|xiph|^px$|lumbar"),
)  # fmt: skip
_PATTERNS = tuple((part, re.compile(pattern)) for part, pattern in _PARTS)

HEIGHTS = {
    "toe": 0.01, "heel": 0.02, "ankle": 0.04, "shank": 0.16, "knee": 0.285, "thigh": 0.40,
    "pelvis": 0.54, "trunk": 0.70, "shoulder": 0.82, "head": 0.94,
}  # fmt: skip
"""How high each part is on a person who stands, as a share of the stature; arms go anywhere."""

_STATURE_M = 1.75
LINKS_M = {
    ("knee", "ankle"): 0.245 * _STATURE_M,
    ("pelvis", "knee"): 0.265 * _STATURE_M,
    ("ankle", "toe"): 0.095 * _STATURE_M,
    ("pelvis", "shoulder"): 0.285 * _STATURE_M,
    ("shoulder", "head"): 0.125 * _STATURE_M,
    ("shoulder", "elbow"): 0.185 * _STATURE_M,
    ("elbow", "wrist"): 0.146 * _STATURE_M,
}
"""Distances within a person of 1.75 m that depend little on the posture [m]."""


@dataclass(frozen=True)
class Place:
    """Where a name says that its point sits.

    Attributes:
        part: One of `HEIGHTS`, ``"elbow"``, ``"wrist"``, ``"arm"``, or empty where the name tells
            nothing.
        side: ``"l"``, ``"r"`` or empty.
    """

    part: str
    side: str


@cache
def place_of(name: str) -> Place:
    """Return where a marker or joint sits, as far as its name tells."""
    spaced = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", re.split(r"[:|/]", name)[-1])
    plain = re.sub(r"[^a-z0-9]+", "_", spaced.lower()).strip("_")
    joined = plain.replace("_", "")
    spellings = (joined, plain)  # in one piece, T10 of Anna_T10 would look like the end of joint10
    part = next((p for p, look in _PATTERNS if any(map(look.search, spellings))), "")
    side = re.match(r"[LR](?=[A-Z][a-z])", spaced)  # as in RBigToe
    return Place(part, side[0].lower() if side else _side(plain))


def _side(plain: str) -> str:
    words = plain.split("_")
    for side, word in (("l", "left"), ("r", "right")):
        if plain.startswith(word) or word in words or side in words:
            return side
    # as in LASI, RKNE: the first letter is the side, and what follows is a name of its own
    if len(plain) >= 3 and plain[0] in "lr":
        rest = plain[1:].replace("_", "")
        if any(pattern.match(rest) for _, pattern in _PATTERNS):
            return plain[0]
    return ""
