"""What a stream must be like: the right channels, measured values, a steady clock."""

from __future__ import annotations

import numpy as np

from ..errors import FrameError
from ..recording import FloatArray, Recording

CLOCK_TOLERANCE = 0.5  # of a sampling interval: beyond it, a time stamp does not fit the rate


class StreamChecks:
    """Refuses what does not belong to a stream.

    Args:
        channels: Names of the D channels.
        rate_hz: Frames per second [1/s].
        gaps: Whether NaN is a missing measurement; it is refused otherwise.
    """

    def __init__(self, channels: tuple[str, ...], rate_hz: float, *, gaps: bool) -> None:
        self.channels = channels
        self.rate_hz = rate_hz
        self.gaps = gaps

    def frame(self, frame: FloatArray) -> FloatArray:
        """Return a frame as an array, shape (D,).

        Raises:
            FrameError: It has another shape, or a value that cannot be.
        """
        try:
            frame = np.asarray(frame, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise FrameError(f"a frame must hold numbers, not {frame!r:.60}") from error
        if frame.shape != (len(self.channels),):
            raise FrameError(f"a frame must have shape ({len(self.channels)},), not {frame.shape}")
        wrong = np.isinf(frame) if self.gaps else ~np.isfinite(frame)
        if wrong.any():
            channel = int(np.argmax(wrong))
            raise FrameError(
                f"channel {self.channels[channel]!r} is {frame[channel]}; "
                + ("a missing marker is NaN" if self.gaps else "a frame must be finite")
            )
        return frame

    def frames(self, frames: FloatArray) -> FloatArray:
        """Return many frames as an array, shape (T, D), whatever their values.

        Raises:
            FrameError: They have another shape.
        """
        try:
            frames = np.asarray(frames, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise FrameError(f"frames must hold numbers, not {frames!r:.60}") from error
        if frames.ndim != 2 or frames.shape[1] != len(self.channels):
            raise FrameError(
                f"frames must have shape (T, {len(self.channels)}), not {frames.shape}"
            )
        return frames

    def clock(self, before_s: float | None, time_s: float) -> None:
        """Check a frame's time against that of the frame before it, if there is one [s].

        Raises:
            FrameError: They are not a sampling interval apart.
        """
        step_s = 1.0 / self.rate_hz
        if not np.isfinite(time_s):
            raise FrameError(f"time_s must be finite, not {time_s}")
        if before_s is None:
            return
        passed_s = time_s - before_s
        if abs(passed_s - step_s) > CLOCK_TOLERANCE * step_s:
            raise FrameError(
                f"frames must be {step_s:.4g} s apart ({self.rate_hz:g} Hz), not "
                f"{passed_s:.4g} s; after a gap, end the stream or fill it with NaN"
            )

    def channels_are(self, channels: tuple[str, ...], what: str = "the stream") -> None:
        """Check the channels of a stream, or of something else.

        Raises:
            FrameError: They are others.
        """
        if channels != self.channels:
            raise FrameError(
                f"{what} has {len(channels)} channels ({', '.join(channels[:3])}, ...); the "
                f"learner was made for {len(self.channels)} ({', '.join(self.channels[:3])}, ...)"
            )

    def recording(self, recording: Recording) -> None:
        """Check the rate of a recording, and its channels where no body is observed.

        Raises:
            FrameError: They are others.
        """
        if not self.gaps:
            self.channels_are(recording.channels, f"recording {recording.name!r}")
        if abs(recording.rate_hz - self.rate_hz) > 1e-3 * self.rate_hz:
            raise FrameError(
                f"recording {recording.name!r} has {recording.rate_hz:g} Hz, the learner was made "
                f"for {self.rate_hz:g} Hz; open it with rate_hz={self.rate_hz:g}"
            )
