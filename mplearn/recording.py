"""Recordings of human motion, and the segments that are cut from them.

One index convention holds everywhere: a segment is ``[start, end)`` in frames.
A missing measurement is NaN. Lengths are metres, angles radians, the vertical axis is z.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field, replace
from typing import Any, Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import NDArray

from .errors import InvalidValueError, RecordingError

FloatArray: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.int64]
BoolArray: TypeAlias = NDArray[np.bool_]
Cause: TypeAlias = Literal["", "rest", "dip", "turn", "return", "state", "length", "end", "known"]
CAUSES: tuple[Cause, ...] = get_args(Cause)


@dataclass(frozen=True)
class Segment:
    """A piece of a stream, cut by a segmenter.

    Attributes:
        start: First frame of the segment, counted from the start of the stream.
        end: One past its last frame.
        confidence: How sure the segmenter is of the boundary at ``end``, in [0, 1].
        decided_at: The frame at which the boundary was decided; ``decided_at - end`` is its delay.
        still: True where nothing moved: a pause, which no tree should learn as a motion.
        cause: What made the boundary at ``end``: ``"rest"``, a pause begins or ends; ``"dip"``, the
            speed falls far between two peaks; ``"turn"``, the main motion turns round and the
            posture comes back; ``"return"``, the posture comes back, whatever moves; ``"state"``,
            the density of the motion changes; ``"length"``, the segment was too long to go on;
            ``"end"``, that of the stream; ``"known"``, the speed falls, or the motion turns round,
            too little for a boundary as yet, but a known motion ends there; empty where not known.

    Example:
        >>> Segment(100, 180, cause="rest").length_frames
        80
    """

    start: int
    end: int
    confidence: float = 1.0
    decided_at: int = -1
    still: bool = False
    cause: Cause = ""

    def __post_init__(self) -> None:
        if not 0 <= self.start < self.end:
            raise InvalidValueError(
                f"a segment needs 0 <= start < end, not [{self.start}, {self.end})"
            )

    @property
    def length_frames(self) -> int:
        """Number of frames."""
        return self.end - self.start


@dataclass(frozen=True)
class LabelledSegment:
    """A piece of a recording, named by a person or by a generator.

    Attributes:
        start: First frame.
        end: One past the last frame.
        label: Class of the motion.
        person: Who performs it; empty where unknown.

    Example:
        >>> LabelledSegment(0, 120, "squat", person="s01").label
        'squat'
    """

    start: int
    end: int
    label: str
    person: str = ""

    def __post_init__(self) -> None:
        if not 0 <= self.start < self.end:
            raise InvalidValueError(
                f"a segment needs 0 <= start < end, not [{self.start}, {self.end})"
            )


@dataclass(frozen=True, eq=False)
class Skeleton:
    """The joints that a recording of a skeleton has, as a tree.

    Attributes:
        names: Name of each joint, length J; parents stand before their children.
        parents: Index of each joint's parent, length J; -1 for a root.
        offsets: Where each joint is from its parent while all angles are zero, shape (J, 3) [m], in
            the recording's axes (z up). A root's is from the origin.
        ends: Whether it is an end site: a point where a chain ends, which turns nothing; length J.

    Raises:
        RecordingError: The four do not belong together, or a parent follows its child.

    Example:
        >>> leg = Skeleton(("hip", "knee"), (-1, 0), np.array([[0, 0, 0.9], [0, 0, -0.4]]))
        >>> leg.children(0)
        (1,)
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    offsets: FloatArray
    ends: tuple[bool, ...] = ()

    def __post_init__(self) -> None:
        n_joints = len(self.names)
        offsets = np.asarray(self.offsets, dtype=np.float64)
        ends = tuple(self.ends) or (False,) * n_joints
        if offsets.shape != (n_joints, 3) or {len(self.parents), len(ends)} != {n_joints}:
            raise RecordingError(
                f"{n_joints} joints need as many parents, offsets and ends, not "
                f"{len(self.parents)}, {offsets.shape} and {len(ends)}"
            )
        if not all(-1 <= parent < joint for joint, parent in enumerate(self.parents)):
            raise RecordingError(f"parents must stand before their children, not {self.parents}")
        object.__setattr__(self, "offsets", offsets)
        object.__setattr__(self, "ends", ends)

    def __len__(self) -> int:
        """Number of joints."""
        return len(self.names)

    def children(self, joint: int) -> tuple[int, ...]:
        """Return the indices of the joints that hang on a joint."""
        return tuple(child for child, parent in enumerate(self.parents) if parent == joint)


@dataclass(frozen=True)
class ReadReport:
    r"""How a file was read: what it says, what was found out, what was left out.

    Attributes:
        format: Name of the dialect, as ``"C3D"`` or ``"Motive CSV"``.
        rate_hz: Frames per second in the file [1/s], before any resampling.
        unit_m: Length of the file's unit of length [m]; None where it holds no lengths.
        up: The file's axis that points up, as ``"y"`` or ``"-z"``; empty where that is not known.
        left_out: Names of points, markers or columns that the file holds and the recording not.
        notes: What was found out or done that the file does not say, a sentence each.
        warnings: What contradicts itself, or is in doubt, a sentence each; one in doubt names the
            option that settles it.
        up_in_doubt: Whether another axis than ``up`` may point up.

    Example:
        >>> from pathlib import Path
        >>> from mplearn import open_recording
        >>> rows = "".join(f"{k / 50:.2f},{k % 7}\n" for k in range(100))
        >>> _ = Path("swing.csv").write_text("time_s,elbow\n" + rows)
        >>> report = open_recording("swing.csv").report
        >>> report.format, report.rate_hz, report.warnings
        ('CSV', 50.0, ())
    """

    format: str
    rate_hz: float
    unit_m: float | None = None
    up: str = ""
    left_out: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    up_in_doubt: bool = False


@dataclass(frozen=True, eq=False)
class Recording:
    """A stretch of measured motion.

    Attributes:
        frames: Measurements, shape (T, D); NaN where one is missing. Lengths [m], angles [rad].
        rate_hz: Frames per second [1/s].
        channels: Name of each column, length D. Marker recordings name theirs
            ``"LSHO.x", "LSHO.y", "LSHO.z", ...``: three columns a marker, in this order.
        name: What the recording is called (a file's stem, a take's id).
        person: Who moves; empty where unknown.
        labels: What is known about its segments, in order of their start.
        skeleton: The joints whose angles or positions it holds; None for plain markers, and
            where angles come without their skeleton. Positions are its joints', in the same order.
        report: How its file was read; None where it comes from no file.

    Example:
        >>> import numpy as np
        >>> take = Recording(np.zeros((200, 3)), 100.0, marker_channels(["head"]), name="still")
        >>> len(take), take.channels, take.is_markers
        (200, ('head.x', 'head.y', 'head.z'), True)
        >>> take
        Recording('still', 200 frames of 3 channels at 100 Hz)
    """

    frames: FloatArray
    rate_hz: float
    channels: tuple[str, ...]
    name: str = ""
    person: str = ""
    labels: tuple[LabelledSegment, ...] = field(default=())
    skeleton: Skeleton | None = None
    report: ReadReport | None = None

    def __post_init__(self) -> None:
        try:
            frames = np.asarray(self.frames, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise RecordingError(f"frames must be numbers of shape (T, D): {error}") from error
        if frames.ndim != 2:
            raise RecordingError(f"frames must have shape (T, D), not {frames.shape}")
        given: object = self.channels
        if isinstance(given, (str, set, frozenset)) or not isinstance(given, Collection):
            raise RecordingError(f"channels must be names, one a column, not {given!r:.80}")
        if frames.shape[1] != len(self.channels):
            raise RecordingError(
                f"{frames.shape[1]} columns need as many channel names, not {len(self.channels)}"
            )
        rate: Any = self.rate_hz
        if isinstance(rate, np.ndarray) and rate.ndim == 0:  # as an archive of NumPy has it
            rate = rate.item()
        number = isinstance(rate, (int, float, np.integer, np.floating))
        if not (number and np.isfinite(rate) and rate > 0):
            raise RecordingError(f"rate_hz must be a positive, finite number, not {rate!r:.80}")
        if np.isinf(frames).any():
            raise RecordingError("frames hold infinite values; a missing measurement is NaN")
        object.__setattr__(self, "frames", frames)
        object.__setattr__(self, "rate_hz", rate)
        object.__setattr__(self, "channels", tuple(self.channels))
        object.__setattr__(self, "labels", tuple(self.labels))

    def __repr__(self) -> str:
        """Return how many frames of how many channels there are."""
        what = f"{len(self)} frames of {len(self.channels)} channels at {self.rate_hz:g} Hz"
        return f"Recording({self.name!r}, {what})"

    def __len__(self) -> int:
        """Number of frames."""
        return int(self.frames.shape[0])

    @property
    def duration_s(self) -> float:
        """Length in seconds."""
        return len(self) / self.rate_hz

    @property
    def is_markers(self) -> bool:
        """Whether the columns are markers, three a marker (``name.x``, ``name.y``, ``name.z``)."""
        return are_markers(self.channels)

    @property
    def marker_names(self) -> tuple[str, ...]:
        """Names of the markers, length M.

        Raises:
            RecordingError: The columns are not markers.
        """
        if not self.is_markers:
            raise RecordingError(
                f"recording {self.name!r} holds no markers (columns named 'NAME.x', 'NAME.y', "
                f"'NAME.z'); its first columns are {self.channels[:3]}"
            )
        return tuple(name[:-2] for name in self.channels[::3])

    @property
    def markers(self) -> FloatArray:
        """Marker positions, shape (T, M, 3) [m], a view of the frames.

        Example:
            >>> take = Recording(np.zeros((100, 6)), 100.0, marker_channels(("LSHO", "RSHO")))
            >>> take.markers.shape  # a view: what is written into it is written into the frames
            (100, 2, 3)
        """
        return self.frames.reshape(len(self), len(self.marker_names), 3)

    def sliced(self, start: int, end: int) -> Recording:
        """Return the frames [start, end), with the labels that lie wholly inside, shifted.

        Example:
            >>> take = Recording(np.zeros((300, 1)), 100.0, ("elbow",), name="swing")
            >>> take.sliced(100, 250).duration_s
            1.5
        """
        if not 0 <= start < end <= len(self):
            raise InvalidValueError(
                f"[{start}, {end}) is not inside the recording's [0, {len(self)})"
            )
        labels = tuple(
            replace(s, start=s.start - start, end=s.end - start)
            for s in self.labels
            if s.start >= start and s.end <= end
        )
        return replace(self, frames=self.frames[start:end], labels=labels)


def are_markers(channels: tuple[str, ...]) -> bool:
    """Return whether columns are markers: ``NAME.x``, ``NAME.y``, ``NAME.z`` in turn.

    Example:
        >>> are_markers(("LSHO.x", "LSHO.y", "LSHO.z")), are_markers(("hip", "knee"))
        (True, False)
    """
    return (
        bool(channels)
        and len(channels) % 3 == 0
        and all(name.endswith(f".{'xyz'[i % 3]}") for i, name in enumerate(channels))
    )


def marker_channels(names: tuple[str, ...]) -> tuple[str, ...]:
    """Return the column names of markers: ``("A",)`` -> ``("A.x", "A.y", "A.z")``.

    Example:
        >>> marker_channels(("LSHO", "RSHO"))
        ('LSHO.x', 'LSHO.y', 'LSHO.z', 'RSHO.x', 'RSHO.y', 'RSHO.z')
    """
    return tuple(f"{name}.{axis}" for name in names for axis in "xyz")
