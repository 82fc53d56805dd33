"""Prints all timings. Run with one core to oneself: ``make bench``."""

import os

os.environ.setdefault("NUMBA_NUM_THREADS", "1")  # before numba is imported: one core for all peers
os.environ.setdefault("OMP_NUM_THREADS", "1")

from rich.console import Console
from rich.table import Table

from . import (
    chain,
    environment,
    generation,
    graph,
    hmm,
    inverse_kinematics,
    performing,
    segmentation,
    tree,
)


def main() -> None:
    console = Console(width=130)
    for title, module in (
        ("The learning chain (processor time, one core)", chain),
        ("Inverse kinematics", inverse_kinematics),
        ("Segmentation (one core)", segmentation),
        ("Hidden Markov models (interleaved, one core)", hmm),
        ("The tree", tree),
        ("The graph", graph),
        ("Generation", generation),
        ("Planning and performing", performing),
        ("The environment", environment),
    ):
        table = Table("what", "took", "against", "ratio", title=title, title_justify="left")
        for row in module.rows():
            table.add_row(*row)
        console.print(table)


if __name__ == "__main__":
    main()
