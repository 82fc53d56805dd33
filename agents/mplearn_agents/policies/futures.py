"""What each place is worth in each of several futures of a demonstrator whom one follows."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mplearn.maths.compiling import kernel
from mplearn.recording import FloatArray, IntArray


class Steps(NamedTuple):
    """What a robot can do next in each of C places, as rows of one list.

    Attributes:
        begin: Where the rows of each place begin, shape (C + 1,).
        performed: Which slot each performs, shape (E,); 0 is hold.
        to: In which place each ends, shape (E,).
        ticks: How many moments it takes, shape (E,).
    """

    begin: IntArray
    performed: IntArray
    to: IntArray
    ticks: IntArray

    @classmethod
    def of(cls, ticks: FloatArray, hold_ticks: int) -> Steps:
        """Return them from how long each takes after each, shape (C, C); NaN: not possible.

        Args:
            ticks: See above; in place 0 nothing was performed yet.
            hold_ticks: How long holding takes, which leads nowhere.
        """
        before, after = np.nonzero(np.isfinite(ticks))
        took, places = ticks[before, after].astype(np.int64), np.arange(len(ticks))
        before = np.append(before, places)
        performed = np.append(after, np.zeros_like(places))
        to = np.append(after, places)
        took = np.append(took, np.full_like(places, hold_ticks))
        order = np.argsort(before, kind="stable")
        begin = np.searchsorted(before[order], np.arange(len(places) + 1)).astype(np.int64)
        return cls(begin, performed[order], to[order], took[order])

    def at(self, place: int) -> list[tuple[int, int, int]]:
        """Return what can be done in a place: slot, where it ends, how many moments it takes."""
        rows = range(self.begin[place], self.begin[place + 1])
        return [(int(self.performed[e]), int(self.to[e]), int(self.ticks[e])) for e in rows]


class Shown(NamedTuple):
    """What is recognised when, in K futures.

    Attributes:
        ticks: Moments at which motions are recognised from now on, rising, shape (K, M).
        story: Number of what is recognised so far, shape (K, M + 1): futures that look alike after
            so many motions have the same.
        before: Place from which a motion becomes legal when it is recognised, shape (K, M); -1
            where none does.
        after: Slot of the motion, which is where it ends, shape (K, M).
        took: How many moments it takes the robot, shape (K, M).
    """

    ticks: IntArray
    story: IntArray
    before: IntArray
    after: IntArray
    took: IntArray

    @classmethod
    def of(cls, order: IntArray, ticks: IntArray, before: IntArray, took: IntArray) -> Shown:
        """Return it from the slots in the order in which they are recognised, shape (K, M).

        Args:
            order: See above; -1 where a future has no more of them.
            ticks: See `Shown`, as for what follows.
            before: See there.
            took: See there.
        """
        stories, n_before = [np.zeros(len(order), np.int64)], 1
        for m in range(order.shape[1]):
            both = np.stack((stories[-1], order[:, m]), axis=1)
            _, which = np.unique(both, axis=0, return_inverse=True)
            stories.append(which.reshape(-1).astype(np.int64) + n_before)
            n_before = int(stories[-1].max()) + 1
        return cls(ticks, np.stack(stories, axis=1), before, order, took)


class Futures(NamedTuple):
    """What the best plan of each future earns from each moment and place on.

    Attributes:
        paid: What the slots that a future has would have earned until each moment, (K, U, N + 1).
        row: Row in ``paid`` of each slot, shape (K, C); -1 where the future has not got it.
        values: What the best plan earns from there on, shape (K, N + 1, C).
    """

    paid: FloatArray
    row: IntArray
    values: FloatArray

    def earned(self, slot: int, ticks: int) -> float:
        """Return what performing a slot from now on earns on average in all futures."""
        rows, end = self.row[:, slot], min(ticks, self.paid.shape[2] - 1)
        won = self.paid[np.arange(len(rows)), rows, end]
        return float(np.where(rows >= 0, won, 0.0).mean())

    @classmethod
    def of(
        cls, doing: IntArray, steps: Steps, shown: Shown, weights: FloatArray, soonest: IntArray
    ) -> Futures:
        """Return them by dynamic programming, backwards in time.

        Args:
            doing: Slot that the demonstrator performs at each moment, shape (K, N).
            steps: What the robot can do.
            shown: What it can do besides, when it is recognised.
            weights: What agreement at each moment earns, shape (N,).
            soonest: Moment before which it cannot be in each place, shape (C,): what that would be
                worth is not computed.
        """
        n_futures, n_places = len(doing), len(steps.begin) - 1
        row = np.full((n_futures, n_places), -1, np.int64)
        n_rows = 1
        for k in range(n_futures):
            slots = np.unique(doing[k])
            row[k, slots] = np.arange(len(slots))
            n_rows = max(n_rows, len(slots))
        paid = np.zeros((n_futures, n_rows, len(weights) + 1))
        values = np.zeros((n_futures, len(weights) + 1, n_places))
        _solve(doing, row, steps, shown, weights, soonest, paid, values)
        return cls(paid, row, values)


@kernel
def _solve(
    doing: IntArray,
    row: IntArray,
    steps: Steps,
    shown: Shown,
    weights: FloatArray,
    soonest: IntArray,
    paid: FloatArray,
    values: FloatArray,
) -> None:
    """Fill ``paid`` and ``values``, see `Futures`."""
    n = len(weights)
    for k in range(len(doing)):
        for t in range(n):
            paid[k, :, t + 1] = paid[k, :, t]
            paid[k, row[k, doing[k, t]], t + 1] += weights[t]
        for t in range(n - 1, -1, -1):
            for place in range(len(soonest)):
                if t < soonest[place]:
                    continue
                best = 0.0
                for e in range(steps.begin[place], steps.begin[place + 1]):
                    end = min(t + steps.ticks[e], n)
                    value = values[k, end, steps.to[e]]
                    slot = row[k, steps.performed[e]]
                    if slot >= 0:
                        value += paid[k, slot, end] - paid[k, slot, t]
                    best = max(best, value)
                for m in range(shown.ticks.shape[1]):
                    if shown.before[k, m] == place and shown.ticks[k, m] <= t:
                        end, slot = min(t + shown.took[k, m], n), row[k, shown.after[k, m]]
                        value = values[k, end, shown.after[k, m]]
                        if slot >= 0:
                            value += paid[k, slot, end] - paid[k, slot, t]
                        best = max(best, value)
                values[k, t, place] = best


@kernel
def worth(
    of: IntArray,
    place: int,
    tick: int,
    decisions: int,
    steps: Steps,
    futures: Futures,
    shown: Shown,
) -> float:
    """Return what is earned on average from there on by who sees no more than is recognised.

    Args:
        of: Which futures there are left, shape (k,).
        place: Where one is.
        tick: Moment.
        decisions: For how many decisions futures are told apart by what is recognised; then, and
            where one future is left, by all.
        steps: What can be done.
        futures: What it is worth.
        shown: What is recognised when.
    """
    end = futures.values.shape[1] - 1
    if tick >= end:
        return 0.0
    total = 0.0
    if decisions == 0 or len(of) == 1:
        for k in of:
            total += futures.values[k, tick, place]
        return total / len(of)
    story = np.empty(len(of), np.int64)
    for i, k in enumerate(of):
        n = 0
        while n < shown.ticks.shape[1] and shown.ticks[k, n] <= tick:
            n += 1
        story[i] = shown.story[k, n]
    done = np.zeros(len(of), np.bool_)
    for i in range(len(of)):
        if done[i]:
            continue
        alike = story == story[i]
        done |= alike
        part = of[alike]
        best, n_steps = 0.0, steps.begin[place + 1] - steps.begin[place]
        for i_step in range(n_steps + shown.ticks.shape[1]):
            e, m, one = steps.begin[place] + i_step, i_step - n_steps, part[0]
            if m < 0:
                slot, to, took = steps.performed[e], steps.to[e], steps.ticks[e]
            elif shown.before[one, m] == place and shown.ticks[one, m] <= tick:
                slot = to = shown.after[one, m]  # of all that look alike
                took = shown.took[one, m]
            else:
                continue
            later, gained = min(tick + took, end), 0.0
            for k in part:
                row = futures.row[k, slot]
                if row >= 0:
                    gained += futures.paid[k, row, later] - futures.paid[k, row, tick]
            rest = worth(part, to, later, decisions - 1, steps, futures, shown)
            best = max(best, gained / len(part) + rest)
        total += best * len(part)
    return total / len(of)
