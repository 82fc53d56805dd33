"""Takes of a folder as recordings of the same channels, joined by name."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

from ..errors import RecordingError
from ..recording import Recording, marker_channels

_LEAST_SHARE = 0.5  # of the usual channels that a take must have to be joined to the others


@dataclass(frozen=True, eq=False)
class Joined:
    """Takes with the same channels in the same order.

    Attributes:
        recordings: Those that could be joined.
        refused: Why not, by name, for the others.
        dropped: Names of channels, or of markers, that not all have, in order.
    """

    recordings: tuple[Recording, ...]
    refused: Mapping[str, RecordingError]
    dropped: tuple[str, ...]


def join_by_name(recordings: Sequence[Recording]) -> Joined:
    """Return takes in their common channels, in the order of the first take of the usual kind.

    A take that has less than half of the usual channels is refused. Markers are joined as wholes.

    Args:
        recordings: At least one.

    Example:
        >>> import numpy as np
        >>> from mplearn.recording import marker_channels
        >>> ours = Recording(np.zeros((5, 9)), 100.0, marker_channels(("C7", "T10", "LASI")), "a")
        >>> theirs = Recording(np.ones((4, 9)), 100.0, marker_channels(("LASI", "C7", "STRN")), "b")
        >>> [take.marker_names for take in join_by_name([ours, theirs]).recordings]
        [('C7', 'LASI'), ('C7', 'LASI')]
    """
    markers = [recording.is_markers for recording in recordings]
    names = [
        recording.marker_names if is_markers else recording.channels
        for recording, is_markers in zip(recordings, markers, strict=True)
    ]
    kinds = Counter(
        (is_markers, frozenset(n)) for is_markers, n in zip(markers, names, strict=True)
    )
    (usual_markers, usual), _ = kinds.most_common(1)[0]
    fits = [
        is_markers == usual_markers and len(usual & set(n)) >= _LEAST_SHARE * len(usual)
        for is_markers, n in zip(markers, names, strict=True)
    ]
    refused = {
        recording.name: RecordingError(
            f"{recording.name}: {len(n)} {'markers' if is_markers else 'channels'}, of which "
            f"{len(usual & set(n))} are among the {len(usual)} that most takes have; expected at "
            f"least half of them"
        )
        for recording, n, is_markers, fit in zip(recordings, names, markers, fits, strict=True)
        if not fit
    }
    kept = [(r, n) for r, n, fit in zip(recordings, names, fits, strict=True) if fit]
    everywhere = set.intersection(*(set(n) for _, n in kept))
    order = tuple(name for name in kept[0][1] if name in everywhere)
    dropped = dict.fromkeys(name for _, n in kept for name in n if name not in everywhere)
    channels = marker_channels(order) if usual_markers else order
    return Joined(
        tuple(_in_channels(recording, channels) for recording, _ in kept),
        MappingProxyType(refused),
        tuple(dropped),
    )


def with_channels(recording: Recording, channels: tuple[str, ...]) -> Recording:
    """Return a recording with these of its channels, in this order.

    Raises:
        RecordingError: It lacks some.

    Example:
        >>> import numpy as np
        >>> take = Recording(np.array([[1.0, 2.0, 3.0]]), 100.0, ("x", "y", "z"))
        >>> with_channels(take, ("z", "x")).frames.tolist()
        [[3.0, 1.0]]
    """
    place = {name: i for i, name in enumerate(recording.channels)}
    lacking = [name for name in channels if name not in place]
    if lacking:
        raise RecordingError(
            f"{recording.name} lacks {len(lacking)} of {len(channels)} channels: "
            f"{', '.join(lacking[:8])}"
        )
    if recording.channels == channels:
        return recording
    columns = [place[name] for name in channels]
    return replace(recording, frames=recording.frames[:, columns], channels=channels)


def _in_channels(recording: Recording, channels: tuple[str, ...]) -> Recording:
    if recording.channels == channels:
        return recording
    place = {name: i for i, name in enumerate(recording.channels)}
    frames = recording.frames[:, [place[name] for name in channels]]
    return replace(recording, frames=frames, channels=channels, skeleton=None)
