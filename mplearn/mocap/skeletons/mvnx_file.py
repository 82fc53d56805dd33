"""What stands in an MVNX file, read as a stream: no tree of the whole XML is ever built."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

import numpy as np

from ...recording import FloatArray, IntArray
from ..files import bad_file
from ..findings import Findings

SAME_RATE = 0.01
"""How far the rates of subject and times, and of two subjects, may differ, as a share."""

_MEASURED = {"position": 3, "orientation": 4, "jointAngle": 3}
_LISTED = {"pos_b": "segments", "connector1": "joints", "connector2": "joints"}
_TEXTS = (*_MEASURED, *_LISTED)
_EXPECTED = "an MVNX file: mvnx, subject, segments, frames"
_CUT_OFF = (3, 5)  # errors of expat: no element found, unclosed token
_MOST_MISSING = 10  # times as many frames as there are
_LARGEST = 1e12  # of a rate [1/s] and of times [ms]
_ARM, _LEG = ("Shoulder", "UpperArm", "ForeArm", "Hand"), ("UpperLeg", "LowerLeg", "Foot", "Toe")
_USUAL_SEGMENTS = (  # of MVN, in its order, where a file lists none
    *("Pelvis", "L5", "L3", "T12", "T8", "Neck", "Head"),
    *(side + part for limb in (_ARM, _LEG) for side in ("Right", "Left") for part in limb),
)


@dataclass(eq=False)
class MVNXFile:
    """An MVNX file.

    Attributes:
        subject: Who moves.
        rate_hz: Frames per second [1/s]; None where it does not say.
        segments: Names of the S segments.
        points: Where the named points of each segment are in its frame [m], by both names.
        joints: Name of each of the K joints, and the parent's and the child's segment and point.
        positions: Origins of the segments, shape (T, S, 3) [m]; None where they are not exported.
        orientations: Quaternions (w, x, y, z), shape (T, S, 4), as the segments in order.
        joint_angles: Shape (T, K, 3) [deg].
        t_pose: Origins of the segments in the T pose, shape (S, 3) [m].
    """

    subject: str = ""
    rate_hz: float | None = None
    segments: list[str] = field(default_factory=list)
    points: dict[tuple[str, str], FloatArray] = field(default_factory=dict)
    joints: list[tuple[str, str, str, str, str]] = field(default_factory=list)
    positions: FloatArray | None = None
    orientations: FloatArray | None = None
    joint_angles: FloatArray | None = None
    t_pose: FloatArray | None = None


def read_mvnx(path: Path, text: str, findings: Findings) -> list[MVNXFile]:
    """Return what an MVNX file holds of each of its subjects.

    Raises:
        RecordingError: The text is not such a file, or declares entities.
    """
    streams = _Streams(path)
    parser = expat.ParserCreate()
    parser.buffer_text = True
    parser.StartElementHandler = streams.start
    parser.EndElementHandler = streams.end
    parser.CharacterDataHandler = streams.text
    parser.StartDoctypeDeclHandler = streams.doctype
    try:
        parser.Parse(text, True)
    except expat.ExpatError as error:
        if error.code not in _CUT_OFF or streams.last is None or streams.numbers < 3:
            raise bad_file(path, f"damaged XML ({error})", _EXPECTED) from error
        streams.last.leave_out_last()
        findings.warn(f"the file is cut off: {streams.numbers} frames before that are read")
    for each in streams.subjects:
        if not each.file.segments and each.has_usual_segments:
            each.file.segments.extend(_USUAL_SEGMENTS)
            findings.warn("no segments are listed: they are taken for the 23 of MVN, in its order")
    whole = [each for each in streams.subjects if each.file.segments and each.numbers]
    if not whole:
        first = streams.subjects[0] if streams.subjects else _Stream(path)
        raise bad_file(
            path, f"{len(first.file.segments)} segments, {first.numbers} frames", _EXPECTED
        )
    for each in streams.subjects:
        if each not in whole:
            findings.warn(f"the subject {each.file.subject!r} has no frames, and is left out")
    return [_measured(path, each, findings) for each in whole]


def _measured(path: Path, stream: _Stream, findings: Findings) -> MVNXFile:
    """Return what the file holds of a subject, its texts as numbers."""
    file = stream.file
    rows = _rows(stream.indices, findings)
    for name, n_parts in (
        ("position", len(file.segments)),
        ("orientation", len(file.segments)),
        ("jointAngle", len(file.joints)),
    ):
        texts = stream.measured[name]
        there = [frame for frame, text in enumerate(texts) if text]
        if not there or not n_parts:
            continue
        if len(there) < len(texts):
            findings.warn(f"{len(texts) - len(there)} of {len(texts)} frames have no {name}")
        found = [texts[frame] for frame in there]
        table = np.full((rows[-1] + 1, n_parts, _MEASURED[name]), np.nan)
        table[rows[there]] = _table(path, found, name, n_parts * _MEASURED[name]).reshape(
            len(there), n_parts, -1
        )
        attribute = {"position": "positions", "orientation": "orientations"}.get(name)
        setattr(file, attribute or "joint_angles", table)
    if stream.t_pose:
        values = _table(path, [stream.t_pose], "position", 3 * len(file.segments))
        file.t_pose = values.reshape(-1, 3)
    file.rate_hz = _rate(file.rate_hz, stream.times_ms, rows, findings)
    return file


def _rate(
    said_hz: float | None, times_ms: list[float], rows: IntArray, findings: Findings
) -> float | None:
    """Return the rate [1/s]: what times say counts where the subject's rate is another."""
    lasts_ms = times_ms[-1] - times_ms[0]
    if not 0.0 < lasts_ms < _LARGEST:
        return said_hz
    measured_hz = 1000.0 * float(rows[-1]) / lasts_ms
    if said_hz is None:
        return measured_hz
    slack = SAME_RATE + measured_hz / 1000.0 / float(rows[-1])  # times are in whole milliseconds
    if abs(measured_hz / said_hz - 1.0) <= slack:
        return said_hz
    findings.warn(f"frameRate is {said_hz:g}, the times say {measured_hz:.6g} Hz, which is used")
    return measured_hz


def _rows(indices: list[int], findings: Findings) -> IntArray:
    """Return the number of each frame from the first on; where they make no sense, one by one."""
    rows = np.array(indices, dtype=np.int64)
    steps = np.diff(rows)
    if (steps < 1).any() or steps.sum() > _MOST_MISSING * len(rows):
        if steps.any():
            findings.warn("the frames' indices do not increase: taken one by one")
        return np.arange(len(rows), dtype=np.int64)
    rows -= rows[0]
    usual = int(np.median(steps)) if len(steps) else 1
    if usual > 1 and not (rows % usual).any():  # every so many frames were exported
        rows //= usual
    if len(rows) <= rows[-1]:
        findings.warn(f"{rows[-1] + 1 - len(rows)} frames are missing by their index")
    return rows


def _table(path: Path, texts: list[str], name: str, width: int) -> FloatArray:
    """Return the numbers of some texts, shape (T, width); decimals may have a comma."""
    if any("," in text for text in texts):
        texts = [text.replace(",", " " if "." in text else ".") for text in texts]
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)  # by which numpy says: no number
        try:
            flat: FloatArray = np.fromstring(" ".join(texts), sep=" ")
        except (DeprecationWarning, ValueError) as error:
            raise bad_file(path, f"a {name} that is no number", "numbers") from error
    if np.isinf(flat).any():
        raise bad_file(path, f"a {name} is infinite", "finite numbers")
    counts = {len(text.split()) for text in texts}
    if counts != {width}:
        wrong = min(counts - {width})
        raise bad_file(path, f"a frame's {name} has {wrong} numbers", f"{width}")
    return flat.reshape(len(texts), width)


class _Streams:
    """What expat calls as it goes through the file: a stream for each subject."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.subjects: list[_Stream] = []

    @property
    def last(self) -> _Stream | None:
        return self.subjects[-1] if self.subjects else None

    @property
    def numbers(self) -> int:
        """Frames of the subject that has most."""
        return max((each.numbers for each in self.subjects), default=0)

    def doctype(self, *_: object) -> None:
        raise bad_file(self.path, "a document type, which may declare entities", "none, as in MVNX")

    def start(self, name: str, attributes: dict[str, str]) -> None:
        plain = name.rpartition(":")[2]
        if plain == "subject" or (plain == "frames" and self.last is None):  # frames alone
            self.subjects.append(_Stream(self.path))
        if self.last is not None:
            self.last.start(name, attributes)

    def text(self, text: str) -> None:
        if self.last is not None:
            self.last.text(text)

    def end(self, name: str) -> None:
        if self.last is not None:
            self.last.end(name)


class _Stream:
    """What is told of one subject, from its first element on."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.file = MVNXFile()
        self.numbers = 0  # frames of the motion
        self.indices: list[int] = []
        self.times_ms: list[float] = []
        self.measured: dict[str, list[str]] = {name: [] for name in _MEASURED}
        self.t_pose = ""
        self._list = ""  # which of the subject's own lists is open; fingers have others
        self._segment = self._point = ""
        self._joint: list[str] = []
        self._frame = ""  # type of the frame that is open
        self._parts: list[str] | None = None

    @property
    def has_usual_segments(self) -> bool:
        """Whether frames have as many numbers as they have of MVN's segments."""
        counts = {
            len(text.split()) / _MEASURED[name]
            for name in ("position", "orientation")
            for text in self.measured[name][:1]
            if text
        }
        return counts == {len(_USUAL_SEGMENTS)}

    def leave_out_last(self) -> None:
        """Forget the frame that was begun last, of which a part may be missing."""
        if self._frame != "normal":
            return
        self.numbers -= 1
        del self.indices[self.numbers :], self.times_ms[self.numbers :]
        for texts in self.measured.values():
            del texts[self.numbers :]

    def start(self, name: str, attributes: dict[str, str]) -> None:
        name = name.rpartition(":")[2]
        if name == "subject":
            self.file.subject = attributes.get("label", "").strip()
            said_hz = _number(attributes.get("frameRate", ""))
            self.file.rate_hz = said_hz if 0 < said_hz < _LARGEST else None
        elif name in ("segments", "joints"):
            self._list = name
        elif name == "segment" and self._list == "segments":
            self._segment = (
                attributes.get("label", "").strip() or f"segment{len(self.file.segments)}"
            )
            self.file.segments.append(self._segment)
        elif name == "point" and self._list == "segments":
            self._point = attributes.get("label", "").strip()
        elif name == "joint" and self._list == "joints":
            self._joint = [attributes.get("label", "").strip()]
        elif name == "frame":
            self._frame = attributes.get("type", "normal").strip().lower() or "normal"
            if self._frame == "normal":
                self.numbers += 1
                for texts in self.measured.values():
                    texts.append("")
                index = attributes.get("index", "")
                self.indices.append(int(index[:12]) if index.isdecimal() else 0)
                self.times_ms.append(_number(attributes.get("time", "")))
        elif name in _MEASURED or _LISTED.get(name) == self._list:
            self._parts = []

    def text(self, text: str) -> None:
        if self._parts is not None:
            self._parts.append(text)

    def end(self, name: str) -> None:
        name = name.rpartition(":")[2]
        if name == "frame":
            self._frame = ""
        elif name == self._list:
            self._list = ""
        if self._parts is None or name not in _TEXTS:
            return
        text, self._parts = "".join(self._parts).strip(), None
        if name in _MEASURED:
            if self._frame == "normal":
                self.measured[name][-1] = self.measured[name][-1] or text
            elif self._frame.startswith("tpose") and name == "position":
                self.t_pose = self.t_pose or text
        elif name == "pos_b":
            place = _table(self.path, [text], name, 3)[0]
            self.file.points[self._segment, self._point] = place
        else:
            segment, _, point = text.partition("/")
            self._joint += [segment, point]
            if len(self._joint) == 5:
                label, *ends = self._joint
                self.file.joints.append((label, ends[0], ends[1], ends[2], ends[3]))


def _number(text: str) -> float:
    """Return a number, NaN for none."""
    try:
        return float(text.replace(",", "."))
    except ValueError:
        return float("nan")
