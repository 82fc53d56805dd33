"""What the columns of a table mean, by their names, in whatever spelling.

Markers are three columns of one name and the axes x, y, z: ``LFHD.x``, ``LFHD_X``, ``LFHD x (mm)``,
``LFHD:X``, ``LFHDx``, ``x_nose``, ``x0``. Times and frame numbers have names of their own.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import takewhile

from ..placing.part_names import place_of
from ..placing.size import named_unit

# fmt: off
MEDIAPIPE_POSE = (
    "nose", "left_eye_inner", "left_eye", "left_eye_outer", "right_eye_inner", "right_eye",
    "right_eye_outer", "left_ear", "right_ear", "mouth_left", "mouth_right", "left_shoulder",
    "right_shoulder", "left_elbow", "right_elbow", "left_wrist", "right_wrist", "left_pinky",
    "right_pinky", "left_index", "right_index", "left_thumb", "right_thumb", "left_hip",
    "right_hip", "left_knee", "right_knee", "left_ankle", "right_ankle", "left_heel",
    "right_heel", "left_foot_index", "right_foot_index",
)
OPENPOSE_BODY_25 = (
    "Nose", "Neck", "RShoulder", "RElbow", "RWrist", "LShoulder", "LElbow", "LWrist", "MidHip",
    "RHip", "RKnee", "RAnkle", "LHip", "LKnee", "LAnkle", "REye", "LEye", "REar", "LEar",
    "LBigToe", "LSmallToe", "LHeel", "RBigToe", "RSmallToe", "RHeel",
)
# fmt: on
_NUMBERED = {33: MEDIAPIPE_POSE, 25: OPENPOSE_BODY_25}

_SEP = r"[\s,._:|/>\-]"
_UNIT_BEHIND = re.compile(r"(?P<name>.*?)\s*[\[(]\s*(?P<unit>[^\])]*?)\s*[\])]\s*$")
_UNIT_JOINED = re.compile(rf"(?P<name>.*[^\s._]){_SEP}(?P<unit>mm|cm|deg|degrees|rad|m)$", re.I)
_UNIT_OF_AXIS = re.compile(
    rf"(?P<name>.*{_SEP}[xyz]){_SEP}(?P<unit>in|inch|inches|ft|feet|dm)$", re.I
)
_AXES = (
    re.compile(
        rf"(?P<name>.+?){_SEP}+(?:pos|position|loc|t|translate)?{_SEP}*(?P<axis>[xyz])$", re.I
    ),
    re.compile(r"(?P<name>.+?)\s*[\[(](?P<axis>[xyz])[\])]$", re.I),
    re.compile(
        rf"(?P<name>.+?){_SEP}+(?P<axis>[xyz]){_SEP}+(?:coord(?:inate)?|pos(?:ition)?)$", re.I
    ),
    re.compile(r"(?P<name>.+?)(?P<axis>[xyz])$", re.I),
    re.compile(rf"(?:(?:pos|position){_SEP}*)?(?P<axis>[xyz]){_SEP}?(?P<name>.+)$", re.I),
)  # fmt: skip
# fmt: off
_NO_POSITION = frozenset((
    "r", "rot", "rotation", "q", "quat", "quaternion", "ori", "orient", "orientation", "ang",
    "angle", "angles", "euler", "vel", "velocity", "acc", "acceleration", "gyro", "mag", "force",
    "moment", "torque", "grf", "cop", "power", "scale", "omega",
))
_OF_A_MARKER = frozenset(("v", "std", "sd", "var", "err", "error"))  # and no other marker
_DECORATION = frozenset((
    "pos", "position", "positions", "coord", "coords", "coordinate", "coordinates", "loc",
    "location", "trans", "translation", "translate", "t", "p", "tr", "point", "xyz", "marker",
    "markers", "landmark", "landmarks", "keypoint", "keypoints", "joint", "joints", "world",
    "global", "pose",
))
_WHOLE = "body"  # as in FreeMoCap's tables, where others have hands and face: it tells where, too
_PARTS = 4  # of a body; so many are those of all of it
_MANY = 12  # markers: what so many names share is not where they sit
# fmt: on
_CONFIDENCE = re.compile(
    rf"(.*{_SEP})?(visibility|presence|likelihood|confidence|conf|score|prob|probability|residual|"
    r"reprojection_?error|v|c|p)\d*$",
    re.I,
)
_WHOSE_TIME = (
    r"(?:unix|epoch|system|host|device|sensor|ros|capture|recording|video|relative|rel|absolute|abs|"
    r"utc|local|date)"
)
_TIME = re.compile(
    rf"(?:{_WHOSE_TIME}{_SEP}?)*"
    rf"(time|times|zeit|temps|tiempo|tempo|tijd|zeitstempel|timestamps?|time{_SEP}?stamps?|t|unix|"
    rf"epoch|elapsed|elapsed{_SEP}?time|clock|secs?|seconds|ms|msec|milliseconds)"
    rf"({_SEP}?(s|secs?|seconds?|ms|msecs?|millis|milliseconds|us|usecs?|micros|microseconds|ns|nsecs?|"
    rf"nanos|nanoseconds|mean|unix))*$",
    re.I,
)
_TIME_UNITS = {
    **dict.fromkeys(("s", "sec", "secs", "second", "seconds"), 1.0),
    **dict.fromkeys(("ms", "msec", "msecs", "millis", "milliseconds"), 1e-3),
    **dict.fromkeys(("us", "usec", "usecs", "micros", "microseconds"), 1e-6),
    **dict.fromkeys(("ns", "nsec", "nsecs", "nanos", "nanoseconds"), 1e-9),
}
_FRAME = re.compile(
    rf"(unnamed: ?0|#|index|idx|row|sample|samples|field|item)$|(sub)?{_SEP}?frames?{_SEP}?"
    rf"(#|no\.?|nr\.?|num|number|index|idx|id|count)?$|(sample|field|row|item){_SEP}?"
    r"(#|no\.?|num|number|index|idx)$",
    re.I,
)
_RATE = re.compile(rf"fps|(?:(?:frame|sampling|sample|capture){_SEP}?)rate({_SEP}?(hz|fps))?", re.I)
_TURN = re.compile(rf"(.+?){_SEP}*[wxyz0-3]", re.I)
_PLACE = re.compile(
    rf"(?:(?:pos|position|coord|loc|location|t|p){_SEP}?)?([xyz])(?:{_SEP}?(?:pos|position|coord))?",
    re.I,
)
_TEXTS = ("label", "segment", "person")
_WHO = re.compile(
    rf"(track|tracking|person|body|subject|skeleton|user|player|actor|individual|instance|human)"
    rf"({_SEP}?(id|idx|index|number|no\.?|name))?$",
    re.I,
)
_FINE = {  # what of a second goes with whole ones
    re.compile(rf"(?:.*{_SEP})?n(?:ano)?sec(?:ond)?s?$", re.I): 1e-9,
    re.compile(rf"(?:.*{_SEP})?(?:u|micro)sec(?:ond)?s?$", re.I): 1e-6,
}
_POINTS = re.compile(
    rf"(marker|landmark|joint|key{_SEP}?point|body{_SEP}?part|bone|point|trajectory|name|"
    rf"segment(?={_SEP}?name))"
    rf"({_SEP}?(name|id|index|label|type))?$",
    re.I,
)


@dataclass(frozen=True)
class Columns:
    """What the columns of a table mean; each is named by its index.

    Attributes:
        names: Names of all columns, without units.
        units: What their header says of their units, as text; empty where nothing.
        times: Columns that may be times.
        frames: Columns that may be numbers of frames.
        texts: Columns of ``label``, ``segment`` and ``person``.
        markers: Markers by name, each with its columns x, y, z.
        doubled: Names of markers that come more than once; the first counts.
        confidences: How sure a landmark is; no measurement.
        points: Column that names the point of each row, where each row is one point.
        rates: Columns that say the rate.
        who: Column that tells people apart.
        fine: Column of what goes with whole seconds, and its unit [s].
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    times: tuple[int, ...]
    frames: tuple[int, ...]
    texts: dict[str, int]
    markers: dict[str, tuple[int, int, int]]
    doubled: tuple[str, ...]
    confidences: tuple[int, ...]
    points: int | None
    rates: tuple[int, ...] = ()
    who: int | None = None
    fine: tuple[int, float] | None = None

    @property
    def measured(self) -> list[int]:
        """Columns that may be measurements."""
        other = {*self.times, *self.frames, *self.texts.values(), *self.confidences, self.points}
        other |= {*self.rates, *self.nameless, self.who, *(self.fine or ())[:1]}
        return [i for i in range(len(self.names)) if i not in other]

    @property
    def nameless(self) -> list[int]:
        """Columns that have no name, among others that have."""
        return [i for i, name in enumerate(self.names) if not name and i not in self.frames]

    @property
    def of_markers(self) -> set[int]:
        """Columns whose names begin as those of a marker: where it is, how it is turned, ..."""
        named = (
            zip(*(self.names[i] for i in axes), strict=False) for axes in self.markers.values()
        )
        alike = (takewhile(lambda each: len(set(each)) == 1, letters) for letters in named)
        known = tuple(stem for stem in ("".join(a for a, *_ in same) for same in alike) if stem)
        beside = {_stem(name) for name in known}  # Hips_quat.w, beside Hips_position.x
        return {
            i
            for i in self.measured
            if (known and self.names[i].startswith(known))
            or ((turn := _TURN.fullmatch(self.names[i])) and _is_turn(turn[1], beside))
        }

    def time_unit_s(self, column: int) -> float | None:
        """Return the unit of a column of times [s], if its header says it."""
        said = self.units[column].lower()
        last = re.split(_SEP, self.names[column].lower())[-1]
        return _TIME_UNITS.get(said, _TIME_UNITS.get(last) if last != "t" else None)


def meaning_of(header: Sequence[str]) -> Columns:
    """Return what columns mean, by their names."""
    split = [_without_unit(_untupled(name.strip())) for name in header]
    names, units = tuple(name for name, _ in split), tuple(unit for _, unit in split)
    texts = {name.lower(): i for i, name in enumerate(names) if name.lower() in _TEXTS}
    special = set(texts.values())
    times = [i for i, name in enumerate(names) if i not in special and _TIME.fullmatch(name)]
    special |= set(times)
    frames = [
        i
        for i, name in enumerate(names)
        if i not in special
        and (_FRAME.fullmatch(name) or (not name and i == 0) or (i < 2 and is_foreign(name)))
    ]
    special |= set(frames)
    rates = [i for i, name in enumerate(names) if i not in special and _RATE.fullmatch(name)]
    free = [i for i in range(len(names)) if i not in {*special, *rates}]
    who = next((i for i in free if _WHO.fullmatch(names[i])), None)
    fine = next(
        ((i, unit) for i in free for look, unit in _FINE.items() if times and look.match(names[i])),
        None,
    )
    free = [i for i in free if i != who and (fine is None or i != fine[0])]
    axes = {i: match[1].lower() for i in free if (match := _PLACE.fullmatch(names[i]))}
    points = [i for i in free if _POINTS.fullmatch(names[i])]
    if points and sorted(axes.values()) == ["x", "y", "z"]:
        # a row for each point; names tell more than numbers
        best = min(points, key=lambda i: names[i].lower().endswith(("id", "index")))
        names = tuple(axes.get(i, name) for i, name in enumerate(names))
        ways = tuple(times), tuple(frames), texts
        return Columns(names, units, *ways, {}, (), (), best, tuple(rates), who, fine)
    markers, doubled = _markers(names, [i for i in free if angle_factor(units[i]) is None])
    used = {i for columns in markers.values() for i in columns}
    numbered = numbered_names(tuple(markers))
    confidences = [i for i in free if i not in used and _CONFIDENCE.fullmatch(names[i])]
    return Columns(
        names,
        units,
        tuple(times),
        tuple(frames),
        texts,
        {numbered.get(name, name): at for name, at in markers.items()},
        doubled,
        tuple(confidences) if markers else (),
        None,
        tuple(rates),
        who if markers else None,
        fine if markers else None,
    )


def is_foreign(name: str) -> bool:
    """Whether a name is in letters of another language, and none of a marker's axes."""
    return not name.isascii() and not any(axes.fullmatch(name) for axes in _AXES)


def numbered_triples(names: Sequence[str]) -> list[str]:
    """Return names of columns that come in threes, ``LFHD_0, LFHD_1, LFHD_2``, if most do.

    Example:
        >>> numbered_triples(["a_1", "a_2", "a_3", "b_1", "b_2", "b_3"])
        ['a_1, a_2, a_3', 'b_1, b_2, b_3']
        >>> numbered_triples(["hip", "knee_1"])
        []
    """
    groups: defaultdict[str, list[str]] = defaultdict(list)
    for name in names:
        if match := re.fullmatch(rf"(.+?){_SEP}?(?:[0-3]|\[[0-3]\])", name):
            groups[match[1]].append(name)
    triples = [", ".join(group) for group in groups.values() if len(group) == 3]
    return triples if 6 * len(triples) > len(names) else []


def angle_factor(unit: str) -> float | None:
    """Return what turns an angle of a named unit to radians; None for no unit of angle."""
    plain = unit.strip().lower().rstrip(".")
    if plain in ("deg", "degree", "degrees", "°"):
        return 0.017453292519943295
    return 1.0 if plain in ("rad", "radian", "radians") else None


def _untupled(name: str) -> str:
    """Return ``LFHD.x`` for ``('LFHD', 'x')``, as pandas joins the levels of a header."""
    match = re.fullmatch(r"\(([^()]+,[^()]+)\)", name)
    return ".".join(part.strip(" '\"") for part in match[1].split(",")) if match else name


def _without_unit(name: str) -> tuple[str, str]:
    for pattern in (_UNIT_BEHIND, _UNIT_JOINED, _UNIT_OF_AXIS):
        match = pattern.fullmatch(name)
        if match is None or not match["name"]:
            continue
        unit = match["unit"]
        known = (
            named_unit(unit) is not None
            or angle_factor(unit) is not None
            or unit.lower() in _TIME_UNITS
        )
        if known:
            return match["name"].strip(), unit
    return name, ""


def _markers(
    names: tuple[str, ...], free: list[int]
) -> tuple[dict[str, tuple[int, int, int]], tuple[str, ...]]:
    markers: dict[str, tuple[int, int, int]] = {}
    doubled: list[str] = []
    left = list(free)
    for pattern in _AXES:
        groups: defaultdict[str, dict[str, list[int]]] = defaultdict(lambda: defaultdict(list))
        for i in left:
            match = pattern.fullmatch(names[i])
            if match is not None:
                groups[match["name"].strip()][match["axis"].lower()].append(i)
        left_sides = {name.lower() for name in groups if _last_word(name) == "l"}
        for name in list(groups):
            right_side = _last_word(name) == "r" and f"{name[:-1]}l".lower() in left_sides
            if _last_word(name) in _NO_POSITION and not right_side:
                del groups[name]
        for name, axes in groups.items():
            if set(axes) != {"x", "y", "z"}:
                continue
            if name in markers or any(len(columns) > 1 for columns in axes.values()):
                doubled.append(name)
            markers.setdefault(name, (axes["x"][0], axes["y"][0], axes["z"][0]))
            left = [i for i in left if i not in {i for each in axes.values() for i in each}]
    order = dict(sorted(markers.items(), key=lambda item: min(item[1])))
    derived = {
        name
        for name in order
        if _last_word(name) in _OF_A_MARKER and re.sub(rf"{_SEP}+\w+$", "", name) in order
    }
    plain = _undecorated([name for name in order if name not in derived])
    kept = (columns for name, columns in order.items() if name not in derived)
    return dict(zip(plain, kept, strict=True)), tuple(doubled)


def _undecorated(names: list[str]) -> list[str]:
    """Return names without the words and quotes that all of them begin or end with.

    A word that tells where on a body, or on which side, stays; so does what few names share.
    """
    ways = (
        (r"([^\W_]+)[\W_]+(.+)", 1, 2),
        (r"(.+?)[\W_]+([^\W_]+)", 2, 1),
        (r"(.*?[^\W_])(Pos|Position|Coord|Trans)", 2, 1),
        (r"(.*?[^\W_])(T)", 2, 1),  # LFHDTX
        (r"(['\"])(.+)\1", 0, 2),
    )
    for pattern, word, rest in ways:
        matches = [match for name in names if (match := re.fullmatch(pattern, name))]
        words = {match[word].lower() for match in matches} if word else set()
        short = [match[rest] for match in matches]
        shared = not word or (len(words) == 1 and _may_go(words.pop(), short))
        differ = len(names) >= 3 and len(short) == len(set(short)) == len(names)
        if word and pattern.endswith("(T)"):  # a single letter must hide what is known
            shared = shared and _n_known(short) > _n_known(names)
        if shared and differ and not all(name.isdigit() for name in short):  # T_1 is a vertebra
            names = short
    return names


def _n_known(names: list[str]) -> int:
    return sum(bool(place_of(name).part) for name in names)


def _may_go(word: str, rest: list[str]) -> bool:
    """Whether a word that all names share tells nothing that what is left of them does not.

    A part of a body or a side stays; but all bones may have a head, ``Hips.head, LeftArm.head``.
    """
    parts = [place_of(name).part for name in rest]
    told = len(set(parts) - {""}) >= _PARTS and 2 * parts.count("") < len(parts)
    place = place_of(word)
    tells = word == _WHOLE or place.side or (place.part and not told)
    return bool(word in _DECORATION or (len(rest) >= _MANY and not tells))


def _is_turn(name: str, beside: set[str]) -> bool:
    """Whether columns of a name tell how something is turned, or moves, that is one of others."""
    return _last_word(name) in _NO_POSITION and _stem(name) in beside


def _stem(name: str) -> str:
    """Return ``hips`` for ``Hips_position.`` and ``Hips_quat``."""
    words = [word for word in re.split(rf"{_SEP}+", name.lower()) if word]
    last = words[-1] if len(words) > 1 else ""
    return " ".join(words[:-1] if last in _NO_POSITION | _DECORATION else words)


def _last_word(name: str) -> str:
    spaced = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name)
    words = [word for word in re.split(_SEP, spaced) if word]
    return words[-1].lower() if words else ""


def numbered_names(names: Sequence[str]) -> dict[str, str]:
    """Return which landmark each name is, if they are only numbered, and as many as are known.

    Example:
        >>> numbered_names([f"landmark_{k}" for k in range(33)])["landmark_32"]
        'right_foot_index'
        >>> numbered_names(["0", "1", "2"])
        {}
    """
    known = _NUMBERED.get(len(names))
    numbers = [re.fullmatch(r"(\D*)(\d{1,3})(\D*)", name) for name in names]
    around = {match.group(1, 3) for match in numbers if match}
    if known is None or not all(numbers) or len(around) > 1:
        return {}
    counted = [int(match[2]) for match in numbers if match]
    first = min(counted)
    if first > 1 or sorted(counted) != list(range(first, first + len(known))):
        return {}
    return {name: known[number - first] for name, number in zip(names, counted, strict=True)}
