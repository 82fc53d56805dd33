"""Observers of different streams, as one that knows everybody."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

from ..body import MotionObserver
from ..body.observer.observer import KnownState, ObserverState
from .bodies import merge_bodies


def merge_observers(
    first: MotionObserver,
    second: MotionObserver,
    known: Mapping[int, int],
    apart: Collection[int],
) -> tuple[ObserverState, dict[int, int]]:
    """Return the state of the first with the people of the second, and their numbers there.

    Neither changes; see `merge_bodies` for what was told.

    Example:
        >>> from mplearn.body import MotionObserver, marker_set
        >>> names = marker_set("plug_in_gait39").names
        >>> first, second = (MotionObserver(names, rate_hz=100.0) for _ in range(2))
        >>> state, numbers = merge_observers(first, second, {}, ())
        >>> len(state.known), numbers
        (0, {})
    """
    state = first.state()
    bodies, numbers = merge_bodies(first.identity.bodies, second.identity.bodies, known, apart)
    fitted = {each.person: each.body for each in state.known}
    for each in second.state().known:
        if each.person in numbers:
            fitted.setdefault(numbers[each.person], each.body)
    merged = replace(
        state,
        identity=replace(state.identity, bodies=bodies),
        known=tuple(KnownState(person, body) for person, body in fitted.items()),
    )
    return merged, numbers
