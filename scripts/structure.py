"""Draw the rooms from what they import: ``python scripts/structure.py``, top floor first.

``--svg FILE`` draws them as a picture (``-``: to standard output), as the site has it. A room is
above all that it imports; an arrow is an import that does not follow from others. Ends with 1 where
rooms import each other in a circle, or a floor one above it.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import NamedTuple

import grimp
import networkx as nx

FLOORS = ("mplearn", "mplearn_envs", "mplearn_agents")  # from the bottom up
FEW = 15  # files of a room


class Floor(NamedTuple):
    """The rooms of a package.

    Attributes:
        name: The package.
        rows: Its rooms, from the top down: each beneath all that import it.
        arrows: Imports between rooms that do not follow from others, from, to.
        files: Files of each room's own, and of the fullest room in it.
        below: Packages beneath of which it imports something.
    """

    name: str
    rows: tuple[tuple[str, ...], ...]
    arrows: tuple[tuple[str, str], ...]
    files: Mapping[str, tuple[int, int]]
    below: tuple[str, ...]


def floors() -> tuple[Floor, ...]:
    """Return all floors, the top one first.

    Raises:
        ValueError: There is a circle, or an arrow upward.
    """
    graph = grimp.build_graph(*FLOORS, exclude_type_checking_imports=False)
    found = []
    for level, package in enumerate(FLOORS):
        rooms = sorted(graph.find_children(package))
        imports: nx.DiGraph[str] = nx.DiGraph()
        imports.add_nodes_from(rooms)
        for room in rooms:
            others = [other for other in rooms if other != room]
            imports.add_edges_from(
                (room, other)
                for other in others
                if graph.direct_import_exists(importer=room, imported=other, as_packages=True)
            )
        if not nx.is_directed_acyclic_graph(imports):
            raise ValueError(f"rooms import each other: {nx.find_cycle(imports)}")
        reached = [
            other
            for other in FLOORS
            if other != package
            and graph.direct_import_exists(importer=package, imported=other, as_packages=True)
        ]
        if above := set(reached) - set(FLOORS[:level]):
            raise ValueError(f"{package} imports {sorted(above)} above it")
        rows = [tuple(sorted(row)) for row in nx.topological_generations(imports)]
        found.append(
            Floor(
                package,
                tuple(rows),
                tuple(sorted(nx.transitive_reduction(imports).edges)),
                {room: _files(graph, room) for room in rooms},
                tuple(reached),
            )
        )
    return tuple(reversed(found))


def _files(graph: grimp.ImportGraph, room: str) -> tuple[int, int]:
    """Return how many files a room has of its own, and the fullest one in it."""
    packages = [room, *(each for each in graph.find_descendants(room) if graph.find_children(each))]
    numbers = [
        1 + sum(not graph.find_children(child) for child in graph.find_children(each))
        for each in packages
    ]
    return numbers[0], max(numbers)


def text(floor: Floor) -> str:
    """Return a floor as lines, a room each: its files, and the rooms that it imports."""
    lines = [f"{floor.name}  (imports {', '.join(floor.below) or 'no other floor'})"]
    for row in floor.rows:
        for room in row:
            own, most = floor.files[room]
            below = [_short(low) for high, low in floor.arrows if high == room]
            many = f", {most} in one of its rooms" if most > max(own, FEW) else ""
            lines.append(f"  {_short(room):16} {own:3} files{many}  -> {', '.join(below)}")
        lines.append("")
    return "\n".join(lines)


def svg(drawn: Sequence[Floor]) -> str:
    """Return the floors as a drawing, as wide as its fullest row."""
    box, gap, rise = 112, 14, 64
    width = max(len(row) for floor in drawn for row in floor.rows) * (box + gap) + gap
    parts, y = [], 24
    for floor in drawn:
        parts.append(f'<text x="{gap}" y="{y}" class="floor">{escape(floor.name)}</text>')
        y += 14
        place = {}
        for row in floor.rows:
            left = (width - len(row) * (box + gap) + gap) / 2
            place |= {room: (left + k * (box + gap), y) for k, room in enumerate(row)}
            y += rise
        for high, low in floor.arrows:
            (x1, y1), (x2, y2) = place[high], place[low]
            parts.append(
                f'<line x1="{x1 + box / 2:.0f}" y1="{y1 + 28}" x2="{x2 + box / 2:.0f}" y2="{y2}"/>'
            )
        for room, (x, top) in place.items():
            parts.append(
                f'<rect x="{x:.0f}" y="{top}" width="{box}" height="28" rx="4"/>'
                f'<text x="{x + box / 2:.0f}" y="{top + 18}">{escape(_short(room))}</text>'
            )
        y += 12
    style = (
        "text{font:12px sans-serif;text-anchor:middle;fill:#111}"
        "text.floor{font-weight:bold;text-anchor:start;fill:#888}"
        "rect{fill:#e3e9ee;stroke:#708090}line{stroke:#8aa;stroke-width:1}"
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {y}" role="img" '
        f'aria-label="Rooms and what they import"><style>{style}</style>{"".join(parts)}</svg>'
    )


def _short(room: str) -> str:
    return room.rpartition(".")[2]


def main() -> int:
    """Print the drawing; return the exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--svg", metavar="FILE", help="draw them into a file; -: print the drawing")
    args = parser.parse_args()
    sys.path[:0] = [".", "envs", "agents"]
    try:
        drawn = floors()
    except ValueError as error:
        print(error, file=sys.stderr)
        return 1
    lines = svg(drawn) if args.svg else "\n".join(map(text, drawn))
    if args.svg in (None, "-"):
        print(lines)
    else:
        Path(args.svg).write_text(lines, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
