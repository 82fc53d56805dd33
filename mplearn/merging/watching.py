"""What was watched in different streams, by one learner."""

from __future__ import annotations

from ..learner import Watching
from .observers import merge_observers


def merge_watching(
    first: Watching, second: Watching, name: str, names: dict[int, str]
) -> dict[int, int]:
    """Let the first know everybody that the second knows, too; the second is used up.

    People are matched where both have watched them by the same markers.

    Args:
        first: Gets to know them.
        second: What it knows.
        name: Whom the second has watched, empty if that was not told: nobody of another name; who
            alone was watched under a name is one person.
        names: Who people of the first are, by their numbers there, empty where that was not told;
            those of the second are added.

    Returns:
        The number in the first of each person of the second.

    Example:
        >>> from mplearn.body import marker_set
        >>> from mplearn.learner import Watching
        >>> from mplearn.recording import marker_channels
        >>> channels = marker_channels(marker_set("plug_in_gait39").names)
        >>> first, second = Watching(channels, 100.0), Watching(channels, 100.0)
        >>> merge_watching(first, second, "", {})  # neither has seen anybody
        {}
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
            called = [names[person] for person in mine.people]
            apart = {k for k, each in enumerate(called) if name and each and each != name}
            alone = name and called.count(name) == 1 == len(other.people)
            known = {0: called.index(name)} if alone else {}
            seen, local = merge_observers(mine.observer, other.observer, known, apart)
            mine.observer.load_state(seen)
            theirs = other.people
        while len(mine.people) < mine.observer.identity.n_people:
            mine.people.append(first.n_people)
            first.n_people += 1
        here = {person: mine.people[local[k]] for k, person in enumerate(theirs)}
        names |= {person: name or names.get(person, "") for person in here.values()}
        numbers |= here
    return numbers
