"""What comes to light while a file is read, gathered for the recording's report."""

from __future__ import annotations

from collections.abc import Iterable

from ..recording import ReadReport


class Findings:
    """Notes, warnings and what is left out; a reader fills it and puts `report` on its recording.

    Args:
        format: Name of the dialect.

    Attributes:
        up_in_doubt: Whether another axis may point up than is taken.

    Example:
        >>> findings = Findings("shouts")
        >>> findings.leave_out(["echo"])
        >>> report = findings.report(25.0)
        >>> report.format, report.left_out
        ('shouts', ('echo',))
    """

    def __init__(self, format: str) -> None:
        self.format = format
        self.up_in_doubt = False
        self._left_out: list[str] = []
        self._notes: list[str] = []
        self._warnings: list[str] = []

    def note(self, text: str) -> None:
        """Say what was found out or done that the file does not say."""
        self._notes.append(text)

    def warn(self, text: str) -> None:
        """Say what contradicts itself or is in doubt."""
        self._warnings.append(text)

    def leave_out(self, names: Iterable[str]) -> None:
        """Name points or columns that the recording does not take over."""
        self._left_out.extend(names)

    def report(self, rate_hz: float, unit_m: float | None = None, up: str = "") -> ReadReport:
        """Return all of it."""
        return ReadReport(
            self.format,
            rate_hz,
            unit_m,
            up,
            tuple(self._left_out),
            tuple(self._notes),
            tuple(self._warnings),
            self.up_in_doubt,
        )
