"""A library sent from process to process: only what has changed since the last time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from mplearn.errors import LibraryError
from mplearn.graph import GraphState, TransitionGraph
from mplearn.library import Primitive, PrimitiveLibrary
from mplearn.state import Range, State, from_plain, to_plain
from mplearn.state.packing import packed, unpacked

from .messages import Header


@dataclass(frozen=True, eq=False)
class Delivery(State):
    """What a library holds, without the primitives that were delivered before.

    Attributes:
        ids: Ids of all primitives, in order.
        changed: The primitives that are new, or other than before.
        graph: The transitions.
        channels: See `PrimitiveLibrary`, as what follows.
        rate_hz: See there.
        body: See there.
    """

    ids: tuple[int, ...]
    changed: tuple[Primitive, ...]
    graph: GraphState
    channels: tuple[str, ...]
    rate_hz: Annotated[float, Range(1e-3, 1e6)]
    body: str


class Sender:
    """Sends libraries; remembers what was sent."""

    def __init__(self) -> None:
        self._sent: dict[int, Primitive] = {}

    def forget(self) -> None:
        """Forget what was sent: whoever receives begins anew."""
        self._sent = {}

    def send(self, library: PrimitiveLibrary) -> tuple[Header, bytes]:
        """Return what must be sent for the receiver to have this library."""
        changed = tuple(p for p in library.primitives if not _same(p, self._sent.get(p.id)))
        self._sent = {p.id: p for p in library.primitives}
        delivery = Delivery(
            library.ids,
            changed,
            library.graph.state(),
            library.channels,
            float(library.rate_hz),
            library.body,
        )
        return packed(to_plain(delivery, whole=True))


class Receiver:
    """Puts libraries together from what was sent."""

    def __init__(self) -> None:
        self._known: dict[int, Primitive] = {}

    def receive(self, content: Header, blob: bytes) -> PrimitiveLibrary:
        """Return the library that was sent, without a recogniser.

        Raises:
            LibraryError: Something was sent before that this receiver has not got.
        """
        delivery = from_plain(Delivery, unpacked(content, blob), whole=True)
        known = self._known | {p.id: p for p in delivery.changed}
        missing = [id for id in delivery.ids if id not in known]
        if missing:
            raise LibraryError(f"primitives {missing} were never delivered")
        self._known = {id: known[id] for id in delivery.ids}
        return PrimitiveLibrary(
            tuple(self._known.values()),
            TransitionGraph.from_state(delivery.graph),
            delivery.channels,
            delivery.rate_hz,
            delivery.body,
        )


def _same(one: Primitive, other: Primitive | None) -> bool:
    return one is other or (
        other is not None
        and one.hmm is other.hmm
        and (one.name, one.n_exemplars, one.parent, one.mean_duration_s)
        == (other.name, other.n_exemplars, other.parent, other.mean_duration_s)
    )
