"""What was watched in different streams, by one learner."""

from __future__ import annotations

from ..learner import Watching
from .observers import merge_observers


def merge_watching(first: Watching, second: Watching) -> dict[int, int]:
    """Let the first know everybody that the second knows, too; the second is used up.

    People are matched where both have watched them by the same markers.

    Returns:
        The number in the first of each person of the second.
    """
    numbers: dict[int, int] = {}
    for other in second.watches:
        mine = next((each for each in first.watches if each.channels == other.channels), None)
        if mine is None:
            first.watches.append(other)
            local = {person: person for person in range(len(other.people))}
            theirs, other.people = other.people, []
            mine = other
        else:
            seen, local = merge_observers(mine.observer, other.observer)
            mine.observer.load_state(seen)
            theirs = other.people
        while len(mine.people) < mine.observer.identity.n_people:
            mine.people.append(first.n_people)
            first.n_people += 1
        numbers |= {person: mine.people[local[k]] for k, person in enumerate(theirs)}
    return numbers
