"""Left and right: which channel is the mirror image of which, and with which sign."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import InvalidValueError
from ..recording import FloatArray

_ODD = ("yaw", "roll")  # angles about axes that lie in the plane between left and right
_SIDES = {"_l": "_r", "_r": "_l"}


@dataclass(frozen=True)
class MirrorMap:
    """The mirror image of a frame: ``sign * frame[source]``.

    Attributes:
        source: For each channel the one that it is taken from, shape (D,).
        sign: 1 or -1 for each channel, shape (D,).

    Example:
        >>> import numpy as np
        >>> mirror = MirrorMap.of(("hand_l.y", "hand_r.y", "head.z"))
        >>> mirror.apply(np.array([[0.3, -0.2, 1.6]])).tolist()  # y points to the left
        [[0.2, -0.3, 1.6]]
    """

    source: tuple[int, ...]
    sign: tuple[int, ...]

    def __post_init__(self) -> None:
        n = len(self.sign)
        if sorted(self.source) != list(range(n)) or not set(self.sign) <= {1, -1}:
            raise InvalidValueError(
                f"a mirror map needs each of 0 to {n - 1} once and signs 1 or -1, "
                f"not {self.source} and {self.sign}"
            )

    @classmethod
    def of(cls, channels: Sequence[str]) -> MirrorMap:
        """Return the map that follows from the channels' names.

        A side is ``_l`` or ``_r`` at the end of a name, or before its ``.x``, ``.y`` or ``.z``.
        Positions have x ahead, y to the left and z up, so y changes its sign; so do angles of roll
        and yaw, whose axes lie in the plane of symmetry.

        Raises:
            InvalidValueError: A channel of one side has no partner on the other.
        """
        places = {name: i for i, name in enumerate(channels)}
        source, sign = [], []
        for name in channels:
            part, dot, axis = name.partition(".")
            partner = f"{part[:-2]}{_SIDES[part[-2:]]}{dot}{axis}" if part[-2:] in _SIDES else name
            if partner not in places:
                raise InvalidValueError(f"channel {name!r} has no partner {partner!r}")
            odd = axis == "y" if dot else any(word in part for word in _ODD)
            source.append(places[partner])
            sign.append(-1 if odd else 1)
        return cls(tuple(source), tuple(sign))

    def apply(self, frames: FloatArray) -> FloatArray:
        """Return the mirror image of frames, shape (T, D).

        Raises:
            InvalidValueError: The frames have another width.
        """
        if frames.shape[-1] != len(self.sign):
            raise InvalidValueError(
                f"frames must have {len(self.sign)} channels, not {frames.shape[-1]}"
            )
        return np.asarray(frames[..., list(self.source)] * np.array(self.sign, dtype=np.float64))
