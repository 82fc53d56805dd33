"""Prints all timings. Run with one core to oneself: ``make bench``."""

import argparse
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
    growing,
    hmm,
    inverse_kinematics,
    live,
    memory,
    performing,
    segmentation,
    states,
    tree,
)

TITLES = {
    chain: "The learning chain (processor time, one core)",
    inverse_kinematics: "Inverse kinematics",
    segmentation: "Segmentation (one core)",
    hmm: "Hidden Markov models (interleaved, one core)",
    tree: "The tree",
    growing: "A vocabulary that grows (processor time)",
    graph: "The graph",
    generation: "Generation",
    performing: "Planning and performing",
    environment: "The environment",
    live: "Live motion",
    memory: "Memory of a stream of ten hours",
    states: "A state, a checkpoint and a library, after one segment more",
}


def main() -> None:
    tables = {module.__name__.rpartition(".")[2]: module for module in TITLES}
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("names", nargs="*", choices=[*tables, []], help="tables (default: all)")
    console = Console(width=130)
    for name in parser.parse_args().names or tables:
        title = TITLES[tables[name]]
        table = Table("what", "took", "against", "ratio", title=title, title_justify="left")
        for row in tables[name].rows():
            table.add_row(*row)
        console.print(table)


if __name__ == "__main__":
    main()
