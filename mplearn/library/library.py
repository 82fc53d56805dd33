"""What has been learned, frozen: the one interface between learning and acting."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, TypeAlias, Unpack

import numpy as np

from ..body import view_of
from ..errors import InvalidValueError, LibraryError, StateError, UnknownPrimitiveError
from ..generation import StyleName, Trajectory, generate, retime
from ..graph import (
    Asked,
    Criterion,
    History,
    LevelledGraph,
    Prediction,
    TransitionGraph,
    tree_levels,
)
from ..offers import ask
from ..recording import FloatArray, Recording
from ..state import from_plain, is_database, require, to_plain, within
from ..tree.recogniser import Recogniser, Recognition
from .content import FILES, LibraryState
from .novelty import AnomalyScore, MotionNovelty, novelty_of
from .primitive import Primitive, TreeNode
from .segment_table import SegmentTable

Key: TypeAlias = int | str


@dataclass(frozen=True, eq=False)
class PrimitiveLibrary:
    """A snapshot of learned primitives and their transitions; nothing here changes.

    Wherever a primitive is asked for, its id or its name will do. Two libraries hold the same if
    their `version` is the same.

    Attributes:
        primitives: The primitives.
        graph: Their transitions; a snapshot that refuses changes, its `copy` can grow.
        channels: Name of each channel, length D.
        rate_hz: Frame rate of models and exemplars [1/s].
        body: Name of the body that moves; empty where the channels are no body's.
        tree: The nodes of the tree.
        recogniser: What recognises segments; None in a library that only acts.

    Raises:
        InvalidValueError: Ids, names or channels are not unique, or parts do not fit each other.

    Example:
        >>> from mplearn.demonstrator import demonstrate
        >>> from mplearn.learner import LearnerConfig, MotionLearner
        >>> take = demonstrate(["BAR", "BAL"] * 6, seed=1, rate_hz=50.0).recording
        >>> learner = MotionLearner(LearnerConfig(take.channels, take.rate_hz))
        >>> events = [*learner.learn_recording(take), *learner.end_stream()]
        >>> library = learner.snapshot()
        >>> first, second = library.names
        >>> library.graph.count(library[first].id, library[second].id) >= 2
        True
        >>> motion = library.generate([first, second])
        >>> motion.frames.shape[1], motion.path == (library[first].id, library[second].id)
        (33, True)
        >>> library.save("two.mplearn").name
        'two.mplearn'
        >>> PrimitiveLibrary.load("two.mplearn").version == library.version
        True
    """

    primitives: tuple[Primitive, ...]
    graph: TransitionGraph = field(repr=False)
    channels: tuple[str, ...]
    rate_hz: float
    body: str = ""
    tree: tuple[TreeNode, ...] = field(default=(), repr=False)
    recogniser: Recogniser | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "primitives", tuple(self.primitives))
        object.__setattr__(self, "channels", tuple(self.channels))
        tree = tuple(node if type(node) is TreeNode else TreeNode(*node) for node in self.tree)
        object.__setattr__(self, "tree", tree)
        ids = [primitive.id for primitive in self.primitives]
        names = [primitive.name for primitive in self.primitives]
        for what, values in (("ids", ids), ("names", names), ("channels", self.channels)):
            if len(set(values)) != len(values):
                twice = [value for value, n in Counter(map(str, values)).items() if n > 1]
                raise InvalidValueError(f"{what} of a library must differ, not {', '.join(twice)}")
        n_channels = len(self.channels)
        for primitive in self.primitives:
            if primitive.hmm.n_channels != n_channels:
                raise InvalidValueError(
                    f"primitive {primitive.id} has {primitive.hmm.n_channels} channels, "
                    f"the library {n_channels}"
                )
            if primitive.rate_hz != self.rate_hz:
                raise InvalidValueError(
                    f"primitive {primitive.id} has rate_hz {primitive.rate_hz}, "
                    f"the library {self.rate_hz}"
                )
        strangers = set(self.graph.ids) - set(ids)
        if strangers:
            raise InvalidValueError(f"the graph names {sorted(strangers)}, which are no primitives")
        graph, missing = self.graph, [id for id in ids if id not in self.graph]
        if missing:
            graph = graph.copy()
            for id in missing:
                graph.add_node(id)
        object.__setattr__(self, "graph", graph.snapshot())

    @classmethod
    def of_fitting(cls, **parts: Any) -> PrimitiveLibrary:
        """Return a library of parts, all attributes, that fit each other: none is looked at."""
        library = object.__new__(cls)
        library.__dict__.update(parts)
        return library

    def __repr__(self) -> str:
        """Return how many primitives there are, and the names of the first."""
        names = ", ".join(self.names[:8]) + (", ..." if len(self) > 8 else "")
        what = f"{len(self.channels)} channels at {self.rate_hz:g} Hz"
        return f"PrimitiveLibrary({len(self)} primitives: {names}; {what})"

    def __deepcopy__(self, memo: dict[int, Any]) -> PrimitiveLibrary:
        """Share it: nothing of it changes."""
        return self

    # ---- what it holds

    def __len__(self) -> int:
        """Number of primitives."""
        return len(self.primitives)

    def __getitem__(self, key: Key) -> Primitive:
        """Return a primitive by id or name.

        Raises:
            UnknownPrimitiveError: There is none.
        """
        found = self._by_key.get(key)
        if found is None:
            names = ", ".join(primitive.name for primitive in self.primitives[:30])
            raise UnknownPrimitiveError(
                f"no primitive {key!r:.80} in the library; it holds {len(self)}: {names}"
            )
        return found

    def __contains__(self, key: object) -> bool:
        """Whether there is a primitive of this id or name."""
        return key in self._by_key

    def __iter__(self) -> Iterator[Primitive]:
        """Go through the primitives."""
        return iter(self.primitives)

    @property
    def ids(self) -> tuple[int, ...]:
        """Ids of the primitives."""
        return tuple(primitive.id for primitive in self.primitives)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the primitives."""
        return tuple(primitive.name for primitive in self.primitives)

    @cached_property
    def version(self) -> str:
        """Hash of all that the library holds, names included: 16 hexadecimal digits."""
        return FILES.digest(to_plain(self._content()))[:16]

    # ---- what it knows

    def recognise(self, frames: FloatArray) -> Recognition:
        """Recognise a segment, shape (T, D).

        Raises:
            InvalidValueError: The library was made without a recogniser, or the segment has other
                channels.

        Example:
            >>> import numpy as np
            >>> from mplearn import LearnerConfig, MotionLearner
            >>> t = np.arange(1200) / 100.0
            >>> swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)[:, None]  # up and down
            >>> learner = MotionLearner(LearnerConfig(("elbow",), segmenter="zero-velocity"))
            >>> events = learner.learn_many(swing)
            >>> library = learner.snapshot()
            >>> found = library.recognise(swing[200:250])  # up
            >>> library[found.primitive].name, found.ratio <= 1.0
            ('P1', True)
        """
        recogniser = self._recogniser
        frames = np.asarray(frames, dtype=np.float64)
        if frames.ndim != 2 or frames.shape[1] != len(self.channels):
            raise InvalidValueError(
                f"a segment must have shape (T, {len(self.channels)}), not {frames.shape}"
            )
        return recogniser.recognise(view_of(self.channels).see(frames))

    def score_motion(self, frames: FloatArray) -> AnomalyScore:
        """Return how unlike every known primitive a segment is, shape (T, D), see `MotionNovelty`.

        Raises:
            InvalidValueError: As `recognise`.

        Example:
            >>> import numpy as np
            >>> from mplearn import LearnerConfig, MotionLearner
            >>> t = np.arange(1200) / 100.0
            >>> swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)[:, None]  # up and down
            >>> learner = MotionLearner(LearnerConfig(("elbow",), segmenter="zero-velocity"))
            >>> events = learner.learn_many(swing)
            >>> library = learner.snapshot()
            >>> up = swing[200:250]
            >>> usual, odd = library.score_motion(up), library.score_motion(5 * up)
            >>> odd.score > usual.score, odd.p_value <= usual.p_value
            (True, True)
        """
        return self.score_recognised(self.recognise(frames))

    def score_recognised(self, found: Recognition) -> AnomalyScore:
        """Return `score_motion` of a segment from what `recognise` has already found for it.

        Raises:
            InvalidValueError: The library was made without a recogniser.
        """
        length = self._recogniser.distance.length
        matches = ((each.node, float(length(each.distance))) for each in found.alternatives)
        return self._novelty.score(matches)

    def score_order(self, sequence: Sequence[Key | None]) -> tuple[AnomalyScore, ...]:
        """Return how unusual each primitive of a sequence is after those before it.

        Args:
            sequence: Primitives in the order they were performed; None where one was not
                recognised.

        Returns:
            A score for each but the first, see `TransitionGraph.surprises` and `p_values`;
            NaN where it or the one before it was not recognised.

        Example:
            >>> import numpy as np
            >>> from mplearn import LearnerConfig, MotionLearner
            >>> t = np.arange(1200) / 100.0
            >>> swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)[:, None]  # up and down
            >>> learner = MotionLearner(LearnerConfig(("elbow",), segmenter="zero-velocity"))
            >>> events = learner.learn_many(swing)
            >>> library = learner.snapshot()
            >>> orders = (["P1", "P2"], ["P1", "P1"])  # nobody went up twice
            >>> usual, odd = (library.score_order(order)[-1] for order in orders)
            >>> odd.score > usual.score
            True
        """
        known = self._known(sequence)
        scores, shares = self.graph.surprises(known), self.graph.p_values(known)
        return tuple(map(AnomalyScore, scores.tolist(), shares.tolist()))

    def predict_next(self, history: Sequence[Key | None], k: int = 3) -> tuple[Prediction, ...]:
        """Return the ``k`` primitives most likely to come next, see `TransitionGraph.predict`.

        Args:
            history: The latest primitives, oldest first; None where one was not recognised.
            k: How many to return at most.

        Example:
            >>> import numpy as np
            >>> from mplearn import LearnerConfig, MotionLearner
            >>> t = np.arange(1200) / 100.0
            >>> swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)[:, None]  # up and down
            >>> learner = MotionLearner(LearnerConfig(("elbow",), segmenter="zero-velocity"))
            >>> events = learner.learn_many(swing)
            >>> library = learner.snapshot()
            >>> coming = library.predict_next(["P1"], k=1)[0]
            >>> library[coming.id].name, coming.probability > 0.5, round(coming.duration_s, 1)
            ('P2', True, 0.5)
        """
        return self.graph.predict(self._known(history), k)

    def segments(self, recording: Recording) -> SegmentTable:
        """Return the segments of a recording as a tidy table, a row each.

        Args:
            recording: Of a body, where the library has one; else with its channels. Its rate may be
                another.

        Returns:
            When each begins and ends, its primitive, name, person, distance, p-value, and how sure
            the boundary is (`mplearn.tables.RecognisedSegment`); pauses are left out.

        Raises:
            RecordingError: The recording lacks channels of the library.
            BodyError: There is no body in it.

        Example:
            >>> from mplearn.demonstrator import demonstrate
            >>> from mplearn.learner import LearnerConfig, MotionLearner
            >>> take = demonstrate(["BAR", "BAL"] * 6, seed=1, rate_hz=50.0).recording
            >>> learner = MotionLearner(LearnerConfig(take.channels, take.rate_hz))
            >>> events = [*learner.learn_recording(take)]
            >>> table = learner.snapshot().segments(take)
            >>> len(table) >= 10, sorted(table.column("name")[-2:])  # one after the other
            (True, ['P1', 'P2'])
        """
        found: SegmentTable = ask("find the segments of a recording")(self, recording)
        return found

    # ---- planning

    def path(
        self,
        start: Key,
        goal: Key,
        *,
        by: Criterion = "probability",
        avoid: Collection[Key] = (),
        visit: Collection[Key] = (),
        **asked: Unpack[Asked],
    ) -> tuple[int, ...]:
        """Return the best path, see `TransitionGraph.path`.

        Example:
            >>> import numpy as np
            >>> from mplearn import LearnerConfig, MotionLearner
            >>> t = np.arange(1200) / 100.0
            >>> swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)[:, None]  # up and down
            >>> learner = MotionLearner(LearnerConfig(("elbow",), segmenter="zero-velocity"))
            >>> events = learner.learn_many(swing)
            >>> library = learner.snapshot()
            >>> library.path("P1", "P2")
            (1, 2)
        """
        return self.k_paths(start, goal, 1, by=by, avoid=avoid, visit=visit, **asked)[0]

    def k_paths(
        self,
        start: Key,
        goal: Key,
        k: int,
        *,
        by: Criterion = "probability",
        avoid: Collection[Key] = (),
        visit: Collection[Key] = (),
        **asked: Unpack[Asked],
    ) -> tuple[tuple[int, ...], ...]:
        """Return up to ``k`` paths, best first, see `TransitionGraph.k_paths`."""
        return self.graph.k_paths(
            self[start].id,
            self[goal].id,
            k,
            by=by,
            avoid=[self[key].id for key in avoid],
            visit=[self[key].id for key in visit],
            **asked,
        )

    def walk(self, start: Key | None, length: int, rng: np.random.Generator) -> tuple[int, ...]:
        """Draw a walk of exactly ``length`` primitives, see `TransitionGraph.walk`.

        Example:
            >>> import numpy as np
            >>> from mplearn import LearnerConfig, MotionLearner
            >>> t = np.arange(1200) / 100.0
            >>> swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)[:, None]  # up and down
            >>> learner = MotionLearner(LearnerConfig(("elbow",), segmenter="zero-velocity"))
            >>> events = learner.learn_many(swing)
            >>> library = learner.snapshot()
            >>> library.walk("P1", 4, np.random.default_rng(1))
            (1, 2, 1, 2)
        """
        return self.graph.walk(None if start is None else self[start].id, length, rng)

    @cached_property
    def levels(self) -> LevelledGraph:
        """The graph with those over the tree's inner nodes above it, to search on above first."""
        parents = {node.id: node.parent for node in self.tree}
        return LevelledGraph(self.graph, tree_levels(parents))

    # ---- acting

    def generate(
        self,
        path: Sequence[Key],
        *,
        style: StyleName = "deterministic",
        rate_hz: float | None = None,
        speed: float = 1.0,
        velocity_limits: FloatArray | None = None,
        acceleration_limits: FloatArray | None = None,
        start: FloatArray | None = None,
        cutoff_hz: float | None = None,
        rng: np.random.Generator | None = None,
    ) -> Trajectory:
        """Generate the motion of a path, see `mplearn.generation.generate`, and retime it.

        Args:
            path: Primitives by id or name, at least one; they need not be connected in the graph.
            style: "deterministic", "nearest", "averaged" or "smooth".
            rate_hz: Frame rate of the trajectory [1/s]; None is the library's.
            speed: Speed relative to the human's; 0.5 is the paper's half speed.
            velocity_limits: Largest speed of each channel, shape (D,) [1/s]; see `retime`.
            acceleration_limits: Largest acceleration of each channel, shape (D,) [1/s^2].
            start: Posture to start from, at rest, shape (D,).
            cutoff_hz: Cut-off of the low-pass filter [1/s]; None is the style's own.
            rng: Source of randomness, needed by "averaged" only.

        Example:
            >>> import numpy as np
            >>> from mplearn import LearnerConfig, MotionLearner
            >>> t = np.arange(1200) / 100.0
            >>> swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)[:, None]  # up and down
            >>> learner = MotionLearner(LearnerConfig(("elbow",), segmenter="zero-velocity"))
            >>> events = learner.learn_many(swing)
            >>> library = learner.snapshot()
            >>> motion = library.generate(["P1", "P2"], style="smooth")
            >>> motion.path, bool(0.8 < motion.frames.max() < 1.1)
            ((1, 2), True)
        """
        motion = generate(
            [self[key] for key in path],
            self.channels,
            self.rate_hz,
            style=style,
            rate_hz=rate_hz,
            start=start,
            cutoff_hz=cutoff_hz,
            rng=rng,
        )
        return retime(motion, velocity_limits, acceleration_limits, speed)

    # ---- naming and keeping

    def rename(self, key: Key, name: str) -> PrimitiveLibrary:
        """Return a library in which a primitive has another name.

        Raises:
            InvalidValueError: The name is empty, not printable, or another primitive's.

        Example:
            >>> import numpy as np
            >>> from mplearn import LearnerConfig, MotionLearner
            >>> t = np.arange(1200) / 100.0
            >>> swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)[:, None]  # up and down
            >>> learner = MotionLearner(LearnerConfig(("elbow",), segmenter="zero-velocity"))
            >>> events = learner.learn_many(swing)
            >>> library = learner.snapshot()
            >>> library.rename("P1", "up").names, library.names  # the old one stays as it was
            (('up', 'P2'), ('P1', 'P2'))
        """
        chosen = self[key]
        if not (isinstance(name, str) and name.strip() and name.isprintable()):
            raise InvalidValueError(f"a name must be printable and not empty, not {name!r}")
        renamed = (
            replace(primitive, name=name) if primitive is chosen else primitive
            for primitive in self.primitives
        )
        return replace(self, primitives=tuple(renamed))

    def save(self, path: str | Path) -> Path:
        """Write the library to a file, all of it or nothing, and return its path.

        Raises:
            LibraryError: The file cannot be written.

        Example:
            >>> import numpy as np
            >>> from mplearn import LearnerConfig, MotionLearner
            >>> t = np.arange(1200) / 100.0
            >>> swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)[:, None]  # up and down
            >>> learner = MotionLearner(LearnerConfig(("elbow",), segmenter="zero-velocity"))
            >>> events = learner.learn_many(swing)
            >>> library = learner.snapshot()
            >>> path = library.save("swings.mplearn")
            >>> from mplearn import PrimitiveLibrary
            >>> PrimitiveLibrary.load(path).names
            ('P1', 'P2')
        """
        FILES.write(Path(path), to_plain(self.state(), whole=True))
        return Path(path)

    @classmethod
    def load(cls, path: str | Path) -> PrimitiveLibrary:
        """Read a library that `save` wrote: equal in every value, and so in `version`.

        A store (`mplearn.store`) will do as well, also while it grows: it is what is known then.

        Raises:
            LibraryError: The file is missing, damaged, foreign, or of a newer version.
            StoreError: It is a store that cannot be read.
        """
        if is_database(Path(path)):
            library: PrimitiveLibrary = ask("read a library from a store")(path)
            return library
        content = FILES.read(Path(path))
        try:
            return cls.from_state(from_plain(LibraryState, content, whole=True))
        except StateError as error:
            raise LibraryError(f"{path} does not describe a library: {error}") from error

    def state(self) -> LibraryState:
        """Return all that the library holds, and its version."""
        return replace(self._content(), version=self.version)

    @classmethod
    def from_state(cls, state: LibraryState) -> PrimitiveLibrary:
        """Return the library that `state` described.

        Raises:
            StateError: Its parts do not fit each other, or are not those that its version says.
        """
        with within("graph"):
            graph = TransitionGraph.from_state(state.graph)
        with within("recogniser"):
            known = state.recogniser
            recogniser = None if known is None else Recogniser.from_state(known)
        with within("primitives"):
            library = cls(
                primitives=state.primitives,
                graph=graph,
                channels=state.channels,
                rate_hz=state.rate_hz,
                body=state.body,
                tree=state.tree,
                recogniser=recogniser,
            )
        if state.version:
            problem = (
                f"must be {library.version}, the hash of the rest, not {state.version!r:.60}: "
                "something was lost or changed"
            )
            require(state.version == library.version, "version", problem)
        return library

    # ---- inside

    def _content(self) -> LibraryState:
        """Return all that the library holds."""
        return LibraryState(
            primitives=self.primitives,
            graph=self.graph.state(),
            channels=self.channels,
            rate_hz=float(self.rate_hz),
            body=self.body,
            tree=self.tree,
            recogniser=None if self.recogniser is None else self.recogniser.state(),
        )

    @cached_property
    def _by_key(self) -> dict[Key, Primitive]:
        keyed: dict[Key, Primitive] = {p.name: p for p in self.primitives}
        return keyed | {p.id: p for p in self.primitives}

    @property
    def _recogniser(self) -> Recogniser:
        if self.recogniser is None:
            raise InvalidValueError("this library holds no recogniser: it can only be performed")
        return self.recogniser

    @cached_property
    def _novelty(self) -> MotionNovelty:
        return novelty_of(self._recogniser)

    def _known(self, sequence: Sequence[Key | None]) -> History:
        return [None if key is None else self[key].id for key in sequence]
