"""Which takes are learned together: dealing depends on the takes alone, never on the workers."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from ..errors import InvalidValueError
from ..mocap import TakeFiles

SHARD_TAKES = 500  # more than most people have


class Shard(NamedTuple):
    """Takes that one learner learns, one after the other.

    Attributes:
        person: Who moves; empty where unknown.
        takes: Names of the takes, in order.

    Example:
        >>> shard = Shard("anna", ("anna/bow", "anna/walk"))
        >>> f"{len(shard.takes)} takes of {shard.person}"
        '2 takes of anna'
    """

    person: str
    takes: tuple[str, ...]


def deal(
    takes: Iterable[TakeFiles], size: int = SHARD_TAKES, dealt: Sequence[Shard] = ()
) -> tuple[Shard, ...]:
    """Deal takes into shards: those of one person together, others in the order of their names.

    Args:
        takes: All takes of the corpus.
        size: Most takes in a shard; somebody who has more has several.
        dealt: Shards of an earlier dealing. They keep their takes, those that are gone included,
            and their places; takes that came since make shards of their own, behind them.

    Raises:
        InvalidValueError: ``size`` is not positive.

    Example:
        >>> from mplearn.mocap.markers.csv_table import CSVReader
        >>> names = ("anna/a", "anna/b", "ben/a", "c")
        >>> takes = [TakeFiles(n, n.split("/")[0] if "/" in n else "", (), CSVReader())
        ...          for n in names]
        >>> [(shard.person, shard.takes) for shard in deal(takes)]
        [('anna', ('anna/a', 'anna/b')), ('ben', ('ben/a',)), ('', ('c',))]
    """
    if size < 1:
        raise InvalidValueError(f"a shard holds at least one take, not {size}")
    known = {name for shard in dealt for name in shard.takes}
    people: dict[str, list[str]] = {}
    for take in sorted(takes, key=lambda take: take.name):
        if take.name not in known:
            people.setdefault(take.person, []).append(take.name)
    order = sorted(people, key=lambda person: (not person, person))  # the unknown come last
    new = (
        Shard(person, tuple(people[person][k : k + size]))
        for person in order
        for k in range(0, len(people[person]), size)
    )
    return (*dealt, *new)
