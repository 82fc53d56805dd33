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
    """An argument or a configuration value lies outside what is allowed.

    Example:
        >>> from mplearn.mocap import Hints
        >>> try:
        ...     Hints(up_axis="up")
        ... except InvalidValueError as error:
        ...     print(error)
        up_axis must be one of x, -x, y, -y, z, -z, not 'up'
    """


class StateError(InvalidValueError):
    """A stored state is damaged, or belongs to something else.

    Attributes:
        problem: What is wrong, the wrong value and the allowed ones.
        place: Where, as in ``tree.nodes[3].matrix``; empty for the state itself.

    Example:
        >>> from mplearn.segmentation import ZeroVelocityConfig
        >>> from mplearn.state import from_plain
        >>> try:
        ...     from_plain(ZeroVelocityConfig, {"still_s": "long"})
        ... except StateError as error:
        ...     print(error.place, "|", error.problem)
        still_s | must be a number, not 'long'
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
    """A recording cannot be read, or does not hold what its format promises.

    Example:
        >>> from mplearn import open_recording
        >>> try:
        ...     open_recording("walk.c3d")
        ... except RecordingError as error:
        ...     print(error)
        walk.c3d: no such file or folder; expected a recording or a folder of recordings
    """


class RecordingWarning(UserWarning):
    r"""A recording contradicts itself, or something of it had to be guessed: see its report.

    Example:
        >>> import warnings
        >>> from pathlib import Path
        >>> from mplearn import open_recording
        >>> rows = "".join(f"{k / 50:.2f},0,0,1.4,0,0,1.3\n" for k in range(100))
        >>> _ = Path("bow.csv").write_text("time_s,C7.x,C7.y,C7.z,C7.x,C7.y,C7.z\n" + rows)
        >>> with warnings.catch_warnings(record=True) as doubts:
        ...     warnings.simplefilter("always")
        ...     take = open_recording("bow.csv")
        >>> [doubt.category.__name__ for doubt in doubts], take.report.warnings[0]
        (['RecordingWarning'], 'the same name more than once: C7; the first one is used')
    """


class FrameError(MPLearnError, ValueError):
    """A frame of a stream has the wrong width, type, rate or content.

    Example:
        >>> from mplearn import LearnerConfig, MotionLearner
        >>> learner = MotionLearner(LearnerConfig(("hip", "knee")))
        >>> try:
        ...     learner.learn_one([0.1, 0.2, 0.3])
        ... except FrameError as error:
        ...     print(error)
        a frame must have shape (2,), not (3,)
    """


class BodyError(MPLearnError):
    """A body, a marker set or a calibration does not fit what is asked of it.

    Example:
        >>> from mplearn.body import human_body
        >>> try:
        ...     human_body(16.0)
        ... except BodyError as error:
        ...     print(error)
        height_m must lie in (0.5, 2.6) m, not 16.0
    """


class ModelError(MPLearnError):
    """A model cannot be fitted to, or used with, the data at hand.

    Example:
        >>> import numpy as np
        >>> from mplearn.hmm import fit
        >>> try:
        ...     fit([np.zeros((3, 1))], n_states=8, variance_floor=1e-3)
        ... except ModelError as error:
        ...     print(error)
        8 states need sequences of at least 8 frames, not 3
    """


class UnknownPrimitiveError(MPLearnError, KeyError):
    """A primitive is named that the tree, graph or library does not hold.

    Example:
        >>> from mplearn.graph import TransitionGraph
        >>> graph = TransitionGraph()
        >>> graph.add_node(1)
        >>> try:
        ...     graph.path(1, 7)
        ... except UnknownPrimitiveError as error:
        ...     print(error)
        primitive 7 is not in the graph; it holds 1 primitives: 1
    """

    def __str__(self) -> str:
        """Return the message itself; ``KeyError`` would quote it."""
        return str(self.args[0]) if self.args else ""


class NoPathError(MPLearnError):
    """The graph holds no walk or path of the kind that was asked for.

    Example:
        >>> from mplearn.graph import TransitionGraph
        >>> graph = TransitionGraph()
        >>> graph.add_node(1), graph.add_node(2)
        (None, None)
        >>> try:
        ...     graph.path(1, 2)
        ... except NoPathError as error:
        ...     print(error)
        no path leads from primitive 1 to 2
    """


class LibraryError(MPLearnError):
    """A library file is damaged, of another version, or not written by mplearn.

    Example:
        >>> from pathlib import Path
        >>> from mplearn import PrimitiveLibrary
        >>> _ = Path("notes.mplearn").write_text("bow, wave")
        >>> try:
        ...     PrimitiveLibrary.load("notes.mplearn")
        ... except LibraryError as error:
        ...     print(error)
        notes.mplearn is damaged, or not an mplearn library: File is not a zip file
    """


class StoreError(MPLearnError):
    """A store cannot be opened, read or written.

    Example:
        >>> from mplearn.store import StoreReader
        >>> try:
        ...     StoreReader("life.db")
        ... except StoreError as error:
        ...     print(type(error).__name__)
        NotAStoreError
    """


class NotAStoreError(StoreError):
    """A file is no store: it is missing, of something else, or was never finished.

    Example:
        >>> from mplearn.store import info
        >>> try:
        ...     info("life.db")
        ... except NotAStoreError as error:
        ...     print(error)
        there is no store life.db
    """


class StoreVersionError(StoreError):
    """A store was written by a newer version of mplearn.

    Example:
        >>> import sqlite3
        >>> from mplearn import LearnerConfig, MotionLearner
        >>> from mplearn.store import LifelongLearner, info
        >>> LifelongLearner.open("life.db", lambda: MotionLearner(LearnerConfig(("x",)))).close()
        >>> with sqlite3.connect("life.db") as file:
        ...     _ = file.execute("PRAGMA user_version = 99")  # as a later mplearn may
        >>> try:
        ...     info("life.db")
        ... except StoreVersionError as error:
        ...     print("written by a newer mplearn")
        written by a newer mplearn
    """


class StoreInUseError(StoreError):
    """A store has a writer already.

    Example:
        >>> from mplearn import LearnerConfig, MotionLearner
        >>> from mplearn.store import LifelongLearner
        >>> with LifelongLearner.open("life.db", lambda: MotionLearner(LearnerConfig(("x",)))):
        ...     try:
        ...         LifelongLearner.open("life.db")
        ...     except StoreInUseError as error:
        ...         print("somebody else learns into it")
        somebody else learns into it
    """


class StoreDamagedError(StoreError):
    """What a store holds is not what was written.

    Example:
        >>> import sqlite3
        >>> from mplearn import LearnerConfig, MotionLearner
        >>> from mplearn.store import LifelongLearner, StoreReader
        >>> LifelongLearner.open("life.db", lambda: MotionLearner(LearnerConfig(("x",)))).close()
        >>> with sqlite3.connect("life.db") as file:
        ...     _ = file.execute("UPDATE part SET data = x'00'")  # as a bad disk may
        >>> try:
        ...     StoreReader("life.db")
        ... except StoreDamagedError as error:
        ...     print(str(error)[:18])
        life.db is damaged
    """


class StoreWriteError(StoreError):
    """A store cannot be written: the disk is full, or the file is read-only.

    Example:
        >>> try:
        ...     raise StoreWriteError("life.db cannot be written: the disk is full")
        ... except StoreError as error:  # whatever is wrong with a store
        ...     print(error)
        life.db cannot be written: the disk is full
    """


class StoreWarning(UserWarning):
    """A store cannot be written for now, or was mended; what was learned is safe in memory.

    Example:
        >>> import warnings
        >>> with warnings.catch_warnings():
        ...     warnings.simplefilter("error", StoreWarning)  # stop, rather than learn on unstored
        ...     try:
        ...         warnings.warn("the disk is full", StoreWarning)
        ...     except StoreWarning as warning:
        ...         print(warning)
        the disk is full
    """


class CorpusError(MPLearnError):
    """A corpus cannot be learned: its workers die, whatever they are given."""


class RobotError(MPLearnError):
    """A robot description is incomplete, or a motion does not fit the robot.

    Example:
        >>> import numpy as np
        >>> from mplearn_envs.robot import Retargeting, humanoid
        >>> try:
        ...     Retargeting(("hip", "knee"), "", humanoid())
        ... except RobotError as error:
        ...     print(str(error)[-66:])
        ed to 'robot'; those of 'robot' and 'human' can, in their features
    """


class MissingDependencyError(MPLearnError, ImportError):
    """A feature needs a package of an extra that is not installed.

    Example:
        >>> from mplearn.extras import require
        >>> try:
        ...     require("no_such_package", "tables")
        ... except MissingDependencyError as error:
        ...     print(error)
        this needs the package 'no_such_package': pip install 'mplearn[tables]'
    """
