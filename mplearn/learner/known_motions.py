"""How a motion under way compares with those that are known, and how surely it is at its end.

What is known helps to cut what comes [Kulic2012, end of 2.1]: in the middle of a known motion a
hesitation is less of a boundary than elsewhere, and at its end a slight turn is more of one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..hmm import MotionTracker, fit
from ..hmm.sequences import SequenceBatch
from ..hmm.stack import ModelStack, score_pairs
from ..recording import FloatArray
from ..tree import PrimitiveTree

LOOKS_HZ = 10.0  # how often it is asked how far a motion has come [1/s]
UNKNOWN = 0.5  # what `Segmenter.scaffold` takes for knowing nothing
INSIDE = 0.4  # how much counts that a motion is not at its end where its end counts for nothing
_N_STATES = 8
_MADE_OF = (8, 6, 4, 3)  # exemplars that a known motion's model is made of: the first so many
_FOLLOWED = 32  # motions that one under way is compared with: those that start nearest to it
_SEEN = 3  # looks before which nothing is said
_SLACK = 0.3  # nat a look and channel by which a motion may lie below the exemplars


class _Known(NamedTuple):
    """A model of a known motion.

    Attributes:
        members: Numbers of the exemplars that it is made of.
        row: Where it is in the stack.
        least: Log-likelihood that a look of its executions has at the least, on average [nat].
    """

    members: list[int]
    row: int
    least: float


class _Starts(NamedTuple):
    """How known motions start.

    Attributes:
        leaves: Their ids.
        members: Numbers of the exemplars of each; other ones are another list.
        means: Mean start of the first of those, shape (n, V).
    """

    leaves: list[int]
    members: list[list[int]]
    means: FloatArray


class KnownMotions:
    """Compares a motion under way with the known ones of whoever moves.

    What it says follows from the tree and from the frames of the motion; what it keeps saves time.

    Args:
        n_channels: Width V of a frame.
        rate_hz: Frames per second [1/s].

    Attributes:
        every: Frames from look to look.
    """

    def __init__(self, n_channels: int, rate_hz: float) -> None:
        self.every = max(1, round(rate_hz / LOOKS_HZ))
        self._stack = ModelStack.room(_FOLLOWED, _N_STATES, n_channels)
        self._tree: PrimitiveTree | None = None
        self._floor: FloatArray | None = None  # of the models' variances
        self._models: dict[int, _Known] = {}  # by leaf, the last asked for at the end
        self._starts = _Starts([], [], np.zeros((0, n_channels)))
        self.forget()

    def forget(self) -> None:
        """Begin again: the motion is another one, or what is known has been changed by hand."""
        self._tracker: MotionTracker | None = None
        self._begun = False
        self._waiting: list[tuple[int, list[int]]] = []  # leaves without a model as yet
        self._found: list[_Known] = []
        self._looks = 0
        self._least = np.zeros(0)

    def looks_at(self, n_frames: int) -> bool:
        """Whether the newest of so many frames of a motion is one that is looked at."""
        return (n_frames - 1) % self.every == 0

    def until_look(self, n_frames: int) -> int:
        """Return how many frames after so many of a motion come until one is looked at."""
        return self.every - (n_frames - 1) % self.every

    def ending(self, tree: PrimitiveTree, frames: FloatArray) -> float:
        """Return the probability that a motion is at its end; 0.5 where it is none that is known.

        Args:
            tree: What is known.
            frames: The motion so far, shape (T, V).
        """
        if not self._begun or tree is not self._tree or tree.bank.floor is not self._floor:
            self.forget()
            self._begin(tree, frames[0])
        if (len(frames) - 1) // self.every + 1 < _SEEN:
            self.get_on()
            return UNKNOWN
        self._model(tree, len(self._waiting))
        if not self._found:
            return UNKNOWN
        if self._tracker is None:
            rows = np.array([each.row for each in self._found])
            self._tracker = MotionTracker(self._stack, rows)
            self._least = np.array([each.least for each in self._found])
        tracker = self._tracker
        for frame in frames[:: self.every][self._looks :]:
            tracker.update(frame)
            self._looks += 1
        above = tracker.log_likelihoods / self._looks - self._least
        best = int(above.argmax())
        return float(tracker.endings[best]) if above[best] >= 0 else UNKNOWN

    def get_on(self) -> None:
        """Do a frame's part of what must be ready at the first look that says anything."""
        tree = self._tree
        if self._waiting and tree is not None and tree.bank.floor is self._floor:
            self._model(tree, -(-_FOLLOWED // (self.every * (_SEEN - 1))))

    def _model(self, tree: PrimitiveTree, most: int) -> None:
        """Make the models of some of the motions that wait for theirs."""
        for leaf, members in self._waiting[:most]:
            self._found.append(self._known(tree, leaf, members))
        del self._waiting[:most]

    def _begin(self, tree: PrimitiveTree, start: FloatArray) -> None:
        """Choose the known motions that one may be that starts so, shape (V,)."""
        self._begun = True
        if tree is not self._tree or tree.bank.floor is not self._floor:
            self._tree, self._floor, self._models = tree, tree.bank.floor, {}
            self._starts = _Starts([], [], np.zeros((0, len(start))))
        leaves, members = tree.leaves, tree.members
        known = [k for k, group in enumerate(members) if len(group) >= _MADE_OF[-1]]
        if len(known) > _FOLLOWED:
            known = self._nearest(tree, known, start)
        chosen = [leaves[k] for k in known]
        for leaf in chosen:  # those stay
            if leaf in self._models:
                self._models[leaf] = self._models.pop(leaf)
        self._waiting = [(leaves[k], _first(members[k])) for k in known]

    def _nearest(self, tree: PrimitiveTree, known: list[int], start: FloatArray) -> list[int]:
        """Return the places of the leaves that start nearest, among those of `known`."""
        all_leaves, all_members = tree.leaves, tree.members
        leaves, members = [all_leaves[k] for k in known], [all_members[k] for k in known]
        before = self._starts
        if before.leaves != leaves:
            places = {leaf: i for i, leaf in enumerate(before.leaves)}
            of = [places.get(leaf, -1) for leaf in leaves]
            held = [before.members[i] if i >= 0 else [] for i in of]
            kept = before.means[of] if before.leaves else np.zeros((len(of), len(start)))
            before = _Starts(leaves, held, kept)
        for i, (then, now) in enumerate(zip(before.members, members, strict=True)):
            if then is not now:
                first = [frames[0] for frames in tree.exemplars(leaves[i])[: _MADE_OF[0]]]
                before.means[i] = np.mean(first, axis=0)
        self._starts = before._replace(members=members)
        offsets = (before.means - start) ** 2 / tree.bank.floor
        order = np.argsort(offsets.sum(axis=1), kind="stable")[:_FOLLOWED]
        return [known[k] for k in sorted(order.tolist())]

    def _known(self, tree: PrimitiveTree, leaf: int, members: list[int]) -> _Known:
        """Return the model of a leaf's first exemplars."""
        known = self._models.get(leaf)
        if known is None and len(self._models) == _FOLLOWED:
            row = self._models.pop(next(iter(self._models))).row  # the one not asked for longest
        elif known is None:
            row = len(self._models)
        elif known.members == members:
            return known
        else:
            row = known.row
        shown = [each[:: self.every] for each in tree.exemplars(leaf)[: len(members)]]
        lengths = [len(each) for each in shown]
        model = fit(shown, min(_N_STATES, *lengths), n_steps=0, variance_floor=tree.bank.floor)
        self._stack.put(row, model)
        pairs = np.array([(row, s) for s in range(len(shown))])
        scores = score_pairs(self._stack, SequenceBatch.of(shown), pairs, complete=False)
        known = _Known(members, row, (scores / lengths).min() - _SLACK * model.n_channels)
        self._models[leaf] = known
        return known


def _first(members: list[int]) -> list[int]:
    """Return the exemplars that a model is made of: not all of few, for then all is made anew."""
    return members[: next(n for n in _MADE_OF if n <= len(members))]
