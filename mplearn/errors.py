"""The errors of mplearn: one base, one class a kind.

A message names the wrong value and the allowed ones.
"""


class MPLearnError(Exception):
    """Base of every error that mplearn raises on purpose.

    Example:
        >>> from mplearn import LearnerConfig, MPLearnError
        >>> try:
        ...     LearnerConfig(("head_x",), rate_hz=7.0)
        ... except MPLearnError as error:
        ...     print(error)
        rate_hz must lie in [20, 250], not 7.0
    """


class InvalidValueError(MPLearnError, ValueError):
    """An argument or a configuration value lies outside what is allowed."""


class StateError(InvalidValueError):
    """A stored state is damaged, or belongs to something else.

    Attributes:
        problem: What is wrong, the wrong value and the allowed ones.
        place: Where, as in ``tree.nodes[3].matrix``; empty for the state itself.
    """

    def __init__(self, problem: str, place: str = "") -> None:
        super().__init__(f"{place}: {problem}" if place else problem)
        self.problem = problem
        self.place = place

    def below(self, step: str) -> "StateError":
        """Return the same error, its place seen from above: ``step`` is a field or ``[index]``."""
        dot = "." if self.place and not self.place.startswith("[") else ""
        return StateError(self.problem, f"{step}{dot}{self.place}")


class RecordingError(MPLearnError):
    """A recording cannot be read, or does not hold what its format promises."""


class RecordingWarning(UserWarning):
    """A recording contradicts itself, or something of it had to be guessed: see its report."""


class FrameError(MPLearnError, ValueError):
    """A frame of a stream has the wrong width, type, rate or content."""


class BodyError(MPLearnError):
    """A body, a marker set or a calibration does not fit what is asked of it."""


class ModelError(MPLearnError):
    """A model cannot be fitted to, or used with, the data at hand."""


class UnknownPrimitiveError(MPLearnError, KeyError):
    """A primitive is named that the tree, graph or library does not hold."""

    def __str__(self) -> str:
        """Return the message itself; ``KeyError`` would quote it."""
        return str(self.args[0]) if self.args else ""


class NoPathError(MPLearnError):
    """The graph holds no walk or path of the kind that was asked for."""


class LibraryError(MPLearnError):
    """A library file is damaged, of another version, or not written by mplearn."""


class StoreError(MPLearnError):
    """A store cannot be opened, read or written."""


class NotAStoreError(StoreError):
    """A file is no store: it is missing, of something else, or was never finished."""


class StoreVersionError(StoreError):
    """A store was written by a newer version of mplearn."""


class StoreInUseError(StoreError):
    """A store has a writer already."""


class StoreDamagedError(StoreError):
    """What a store holds is not what was written."""


class StoreWriteError(StoreError):
    """A store cannot be written: the disk is full, or the file is read-only."""


class StoreWarning(UserWarning):
    """A store cannot be written for now, or was mended; what was learned is safe in memory."""


class CorpusError(MPLearnError):
    """A corpus cannot be learned: its workers die, whatever they are given."""


class RobotError(MPLearnError):
    """A robot description is incomplete, or a motion does not fit the robot."""


class MissingDependencyError(MPLearnError, ImportError):
    """A feature needs a package of an extra that is not installed."""
