"""Other libraries beside ours, as one page: ``python -m benchmarks.peers CMU UI_PRMD``."""

import argparse
from pathlib import Path

from mplearn.evaluation.experiments.page_of_peers import page_of_peers
from mplearn_agents.evaluations import Setting


def run() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("activities", help="a folder whose labels are activities, as of CMU")
    parser.add_argument("repetitions", help="a folder whose labels are repetitions, as UI-PRMD")
    parser.add_argument("--take", help="this take's activities only")
    parser.add_argument("--person", help="this person's repetitions only")
    parser.add_argument("--out", type=Path, help="file to write the page to")
    args = parser.parse_args()
    activities = [each for each in Setting(args.activities).described if each.labels]
    repetitions = Setting(args.repetitions).takes
    if args.take:
        activities = [each for each in activities if each.name == args.take]
    if args.person:
        repetitions = [each for each in repetitions if each.person == args.person]
    page = []
    for table in page_of_peers(activities, repetitions):
        page.append(table.to_markdown())
        print(page[-1], flush=True)
    if args.out is not None:
        args.out.write_text("\n".join(page), encoding="utf-8")


if __name__ == "__main__":
    run()
