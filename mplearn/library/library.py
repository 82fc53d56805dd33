"""What has been learned, frozen: the one interface between learning and acting."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Unpack

import numpy as np

from ..errors import InvalidValueError
from ..generation import StyleName, Trajectory, generate, retime
from ..graph import Asked, Criterion, LevelledGraph, tree_levels
from ..recording import FloatArray
from .content import FILES, from_content, to_content
from .holdings import Key
from .knowledge import Knowledge


@dataclass(frozen=True, eq=False)
class PrimitiveLibrary(Knowledge):
    """A snapshot of learned primitives and their transitions; nothing here changes.

    Wherever a primitive is asked for, its id or its name will do. Two libraries hold the same if
    their `version` is the same. Attributes are those of `Holdings`.
    """

    @cached_property
    def version(self) -> str:
        """Hash of all that the library holds, names included: 16 hexadecimal digits."""
        return FILES.digest(to_content(self))[:16]

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
        """Return the best path, see `TransitionGraph.path`."""
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
        """Draw a walk of exactly ``length`` primitives, see `TransitionGraph.walk`."""
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
        """
        FILES.write(Path(path), to_content(self))
        return Path(path)

    @classmethod
    def load(cls, path: str | Path) -> PrimitiveLibrary:
        """Read a library that `save` wrote: equal in every value, and so in `version`.

        Raises:
            LibraryError: The file is missing, damaged, foreign, or of a newer version.
        """
        return from_content(cls, FILES.read(Path(path)), str(path))
