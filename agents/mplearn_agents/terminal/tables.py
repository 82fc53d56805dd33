"""What a library holds, as tables on the console."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from mplearn_agents.terminal.inert import printable  # before it is laid out: it may get longer

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text
    from rich.tree import Tree

    from mplearn import evaluation
    from mplearn.library import Primitive, PrimitiveLibrary


def show_table(console: Console, table: evaluation.Table, *, json: bool = False) -> None:
    """Print the table of an experiment; as a line of JSON to standard output where asked for."""
    from rich.table import Table

    if json:
        print(table.to_json(), flush=True)
        return
    shown = Table(*table.columns, title=table.title, caption=table.note, caption_justify="left")
    for row in table.rows:
        shown.add_row(*row)
    console.print(shown)


def most_active(primitive: Primitive, channels: Sequence[str], k: int = 3) -> tuple[str, ...]:
    """Return the names of the channels that a primitive moves most, most active first."""
    travel = np.ptp(primitive.hmm.means, axis=0)
    return tuple(channels[i] for i in np.argsort(-travel, kind="stable")[:k])


def primitive_table(library: PrimitiveLibrary) -> Table:
    """Return a row for each primitive."""
    from rich.table import Table
    from rich.text import Text

    table = Table(title="primitives", title_justify="left")
    for name, justify in (("id", "right"), ("name", "left"), ("demonstrations", "right")):
        table.add_column(name, justify=justify)  # type: ignore[arg-type]
    table.add_column("duration", justify="right")
    table.add_column("most active")
    for primitive in library.primitives:
        table.add_row(
            str(primitive.id),
            Text(printable(primitive.name)),
            str(primitive.n_exemplars),
            f"{primitive.mean_duration_s:.2f} s",
            Text(", ".join(most_active(primitive, library.channels))),
        )
    return table


def transition_table(library: PrimitiveLibrary) -> Table:
    """Return a row for each primitive: what followed it, the most frequent first."""
    from rich.table import Table
    from rich.text import Text

    graph = library.graph.to_networkx()
    table = Table(title="transitions", title_justify="left")
    table.add_column("after")
    table.add_column("comes")
    for primitive in library.primitives:
        out = sorted(
            graph.out_edges(primitive.id, data=True), key=lambda e: (-e[2]["probability"], e[1])
        )
        following = [(library[after].name, edge["probability"]) for _, after, edge in out]
        table.add_row(Text(printable(primitive.name)), _following(following))
    return table


def chain_table(library: PrimitiveLibrary) -> Table:
    """Return a row for each chain of primitives that only ever follow each other: nodes merged."""
    from rich.table import Table
    from rich.text import Text

    merged = library.graph.merged()
    table = Table(title="chains, each as one node of the graph", title_justify="left")
    table.add_column("primitives that only follow each other")
    table.add_column("comes")
    graph = merged.graph.to_networkx()
    names = {
        head: " > ".join(library[id].name for id in chain) for head, chain in merged.chains.items()
    }
    for head, chain in merged.chains.items():
        if len(chain) > 1:
            after = sorted(graph.out_edges(head, data=True), key=lambda e: -e[2]["probability"])
            following = [(names[next_head], edge["probability"]) for _, next_head, edge in after]
            table.add_row(Text(printable(names[head])), _following(following))
    return table


def _following(following: Sequence[tuple[str, float]]) -> Text:
    """Return what follows, by name, and how likely each is, in [0, 1], as it stands in a table."""
    from rich.text import Text

    if not following:
        return Text("nothing was seen to follow", "dim")
    told = "; ".join(f"{name} {100 * probability:.0f} %" for name, probability in following)
    return Text(printable(told))


def primitive_tree(library: PrimitiveLibrary) -> Tree:
    """Return the tree that the primitives were learned in."""
    from rich.text import Text
    from rich.tree import Tree

    below: dict[int | None, list[int]] = {}
    counts = {node.id: node.n_exemplars for node in library.tree}
    for node in library.tree:
        below.setdefault(node.parent, []).append(node.id)

    def grow(branch: Tree, parent: int | None) -> None:
        for id in below.get(parent, ()):
            name = library[id].name if id in library else f"node {id}"
            count = (f"{counts[id]} demonstrations", "dim")
            grow(branch.add(Text.assemble(f"{name} ", count)), id)

    tree = Tree("tree")
    grow(tree, None)
    return tree


def library_summary(library: PrimitiveLibrary) -> dict[str, Any]:
    """Return what the tables show, as values that JSON has."""
    graph = library.graph.to_networkx()
    return {
        "version": library.version,
        "body": library.body,
        "rate_hz": library.rate_hz,
        "channels": list(library.channels),
        "primitives": [
            {
                "id": primitive.id,
                "name": primitive.name,
                "demonstrations": primitive.n_exemplars,
                "duration_s": primitive.mean_duration_s,
                "most_active": most_active(primitive, library.channels),
            }
            for primitive in library.primitives
        ],
        "transitions": [
            {"from": before, "to": after, "probability": edge["probability"]}
            for before, after, edge in graph.edges(data=True)
        ],
        "tree": [
            {"id": node.id, "parent": node.parent, "demonstrations": node.n_exemplars}
            for node in library.tree
        ],
    }
