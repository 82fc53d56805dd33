"""A primitive as a library holds it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..errors import InvalidValueError
from ..generation import Dynamics, estimate_dynamics, gaps_filled
from ..hmm import LeftRightHMM
from ..recording import FloatArray
from ..state import complete
from .compact import CompactMotion

_LONGEST_S = 86_400.0


@complete
@dataclass(frozen=True, eq=False)
class Primitive:
    """A motion primitive: a leaf of the tree, frozen.

    Attributes:
        id: Identity, for life.
        hmm: Model, in the units of the library's channels.
        mean_duration_s: How long its demonstrations lasted on average [s].
        n_exemplars: How many demonstrations it was learned from; more than are kept.
        rate_hz: Frame rate of the model and the exemplars [1/s].
        kept: The kept demonstrations, compact.
        name: "P" and the id, until a person gives another.
        parent: Node of the tree above it; None where it hangs from the root.

    Example:
        >>> from mplearn.hmm import fit
        >>> swing = np.sin(np.linspace(0, np.pi, 50))[:, None]
        >>> model = fit([swing], n_states=6, variance_floor=1e-3)
        >>> primitive = Primitive.from_exemplars(1, model, [swing], 50.0, name="swing")
        >>> primitive.name, primitive.mean_duration_s
        ('swing', 1.0)
        >>> primitive
        Primitive(1, 'swing', mean_duration_s=1.00, n_exemplars=1)
    """

    id: int
    hmm: LeftRightHMM
    mean_duration_s: float
    n_exemplars: int
    rate_hz: float
    kept: tuple[CompactMotion, ...] = field(default=(), repr=False)
    name: str = ""
    parent: int | None = None

    def __repr__(self) -> str:
        """Return its id, name, length and number of demonstrations."""
        what = f"mean_duration_s={self.mean_duration_s:.2f}, n_exemplars={self.n_exemplars}"
        return f"Primitive({self.id}, {self.name!r}, {what})"

    def __post_init__(self) -> None:
        if not 0 < self.mean_duration_s <= _LONGEST_S:
            raise InvalidValueError(
                f"mean_duration_s of primitive {self.id} must lie in (0, {_LONGEST_S:g}], "
                f"not {self.mean_duration_s}"
            )
        if not (np.isfinite(self.rate_hz) and self.rate_hz > 0):
            raise InvalidValueError(f"rate_hz must be positive and finite, not {self.rate_hz}")
        if self.n_exemplars < len(self.kept):
            raise InvalidValueError(
                f"primitive {self.id} keeps {len(self.kept)} exemplars of {self.n_exemplars}"
            )
        for motion in self.kept:
            if motion.knots.shape[1] != self.hmm.n_channels:
                raise InvalidValueError(
                    f"an exemplar of primitive {self.id} has {motion.knots.shape[1]} channels, "
                    f"its model {self.hmm.n_channels}"
                )
        if not self.name:
            object.__setattr__(self, "name", f"P{self.id}")
        object.__setattr__(self, "kept", tuple(self.kept))

    @classmethod
    def from_exemplars(
        cls,
        id: int,
        hmm: LeftRightHMM,
        exemplars: Sequence[FloatArray],
        rate_hz: float,
        *,
        n_exemplars: int | None = None,
        mean_duration_s: float | None = None,
        max_kept: int = 3,
        name: str = "",
        parent: int | None = None,
    ) -> Primitive:
        """Make a primitive of a model and its demonstrations.

        The model is rounded to single precision and the exemplars are made compact here, so that
        nothing changes by saving. Missing values in exemplars are filled.

        Args:
            id: Identity.
            hmm: The model.
            exemplars: Demonstrations, shape (T, D) each, at least one.
            rate_hz: Frame rate [1/s].
            n_exemplars: How many it was learned from; None is the number given.
            mean_duration_s: Mean duration of all [s]; None is that of those given.
            max_kept: How many are kept: those of the most usual duration.
            name: Name given by a person.
            parent: Node of the tree above it.

        Raises:
            InvalidValueError: There are no exemplars, or they do not fit the model.
        """
        lengths = np.array([len(frames) for frames in exemplars])
        if not lengths.size or lengths.min() < 1 or max_kept < 0:
            raise InvalidValueError(
                f"primitive {id} needs exemplars of at least one frame and max_kept >= 0"
            )
        for frames in exemplars:
            if frames.shape[1:] != (hmm.n_channels,) or np.isinf(frames).any():
                raise InvalidValueError(
                    f"an exemplar of primitive {id} must be (T, {hmm.n_channels}) without "
                    f"infinite values, not {frames.shape}"
                )
        usual = np.sort(np.argsort(np.abs(lengths - np.median(lengths)), kind="stable")[:max_kept])
        return cls(
            id=int(id),
            hmm=_single_precision(hmm),
            mean_duration_s=float(
                lengths.mean() / rate_hz if mean_duration_s is None else mean_duration_s
            ),
            n_exemplars=len(exemplars) if n_exemplars is None else int(n_exemplars),
            rate_hz=float(rate_hz),
            kept=tuple(CompactMotion.of(gaps_filled(exemplars[i], hmm), rate_hz) for i in usual),
            name=name,
            parent=parent,
        )

    @property
    def exemplars(self) -> tuple[FloatArray, ...]:
        """The kept demonstrations, shape (T, D) each, finite."""
        return tuple(motion.frames for motion in self.kept)

    @cached_property
    def dynamics(self) -> Dynamics:
        """Position, velocity and acceleration per state, estimated from the kept exemplars."""
        return estimate_dynamics(self.hmm, self.exemplars, self.rate_hz)


def _single_precision(hmm: LeftRightHMM) -> LeftRightHMM:
    tiny = float(np.finfo(np.float32).tiny)
    return LeftRightHMM(
        means=hmm.means.astype(np.float32),
        variances=np.maximum(hmm.variances, tiny).astype(np.float32),
        log_stay=np.append(np.minimum(hmm.log_stay[:-1], -tiny), 0.0).astype(np.float32),
    )


class TreeNode(NamedTuple):
    """A node of the tree that the primitives were learned in.

    Attributes:
        id: Identity; that of its primitive, if it is a leaf.
        parent: Node above it; None at the root.
        n_exemplars: How many segments were placed in it.

    Example:
        >>> nodes = (TreeNode(0, None, 3), TreeNode(1, 0, 12), TreeNode(2, 0, 9))
        >>> [node.id for node in nodes if node.parent == 0]
        [1, 2]
    """

    id: int
    parent: int | None
    n_exemplars: int
