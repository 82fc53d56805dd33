"""How smooth and steady the page is: ``python -m benchmarks.live_page --seconds 20 --hours 4``.

In headless Chromium: pictures a second while learning runs at 100 Hz, the time from a click to the
moving figure, and the memory of all processes and of the page while an accelerated demonstrator
goes on.
"""

from __future__ import annotations

import argparse
import statistics
import time
from typing import Any

import psutil
from rich.console import Console
from rich.table import Table

from .teaching_session import browser, live, until

LOOKS = 20
SIZES = ((1280, 720), (1920, 1080))


def smoothness(opened: Any, seconds: float) -> None:
    """Print pictures a second, and how long a click takes."""
    with live("demonstrator") as (url, _):
        for size in SIZES:
            page = opened.new_page(viewport={"width": size[0], "height": size[1]})
            page.goto(url)
            rows = page.locator("#tree .row")
            until(lambda rows=rows: rows.count() >= 3, 300, "three primitives")
            page.keyboard.press("w")
            rates = []
            for _ in range(round(seconds)):
                page.wait_for_timeout(1000)
                rates.append(float(page.get_attribute("html", "data-fps") or 0))
            print(
                f"{size[0]} x {size[1]}: {statistics.median(rates):.0f} pictures a second "
                f"(least {min(rates):.0f}), {page.locator('#figures').inner_text()!r}"
            )
            page.keyboard.press("Escape")
            took = [page.evaluate(_CLICK, k % 3) for k in range(9)]
            print(
                f"   from a click to the figure: {1000 * statistics.median(took):.0f} ms, "
                f"at most {1000 * max(took):.0f} ms"
            )
            page.close()


# click a row, and wait until its figure is there: the time of the page itself [s]
_CLICK = """(k) => new Promise((done) => {
  const root = document.documentElement, before = root.dataset.shown, began = performance.now();
  const row = document.querySelectorAll("#tree .row")[k];
  row.dispatchEvent(new MouseEvent("click", { bubbles: true }));
  const look = () => root.dataset.shown !== before
    ? done((performance.now() - began) / 1000) : requestAnimationFrame(look);
  look();
})"""


def memory(opened: Any, hours: float) -> None:
    """Print the memory of each process, and of the page, while an accelerated stream goes on."""
    heads = ("server [MB]", "learner", "robot", "page's process", "its heap", "nodes", "primitives")
    table = Table("stream [h]", *heads)
    seen: list[tuple[float, ...]] = []
    with live("demonstrator", "--speed", "inf") as (url, process):
        page = opened.new_page(viewport={"width": 1280, "height": 720})
        page.goto(url)
        inside = page.context.new_cdp_session(page)
        begun = time.monotonic()
        for k in range(1, 9):
            frames = 100.0 * 3600.0 * hours * k / 8
            while float(page.get_attribute("html", "data-frames") or 0) < frames:
                page.wait_for_timeout(500)
            used = [
                psutil.Process(pid).memory_info().rss / 1e6
                for pid in (process.pid, *_children(process.pid))
            ]
            held = [_held(page, inside) for _ in range(LOOKS)]  # between them messages come
            heap, nodes = map(min, zip(*held, strict=True))
            n_primitives = page.locator("#tree .row").count()
            drawing = _drawing(opened)
            seen.append((*used, drawing, heap, nodes, n_primitives))
            cells = (f"{value:.1f}" for value in (*used, drawing, heap))
            table.add_row(f"{hours * k / 8:.1f}", *cells, str(nodes), str(n_primitives))
        took = time.monotonic() - begun
    last, first = seen[-1], seen[len(seen) // 2 - 1]
    table.add_row("end / half", *(f"{b / a:.2f}" for a, b in zip(first, last, strict=True)))
    table.title = f"{hours:g} h of stream in {took / 60:.0f} minutes"
    Console(width=100).print(table)


def _held(page: Any, inside: Any) -> tuple[float, int]:
    """Return what a page holds once garbage is collected: its heap [MB], and nodes."""
    page.wait_for_timeout(100)
    inside.send("HeapProfiler.collectGarbage")
    heap = inside.send("Runtime.getHeapUsage")["usedSize"] / 1e6
    return heap, inside.send("Memory.getDOMCounters")["nodes"]


def _drawing(opened: Any) -> float:
    """Return the memory of the browser's largest process, that of the page [MB]."""
    processes = opened.new_browser_cdp_session().send("SystemInfo.getProcessInfo")["processInfo"]
    pages = [psutil.Process(each["id"]) for each in processes if each["type"] == "renderer"]
    return max(float(each.memory_info().rss) for each in pages) / 1e6


def _children(pid: int) -> list[int]:
    """Return the learner's and the robot's process."""
    workers = psutil.Process(pid).children()
    return [w.pid for w in workers if any("spawn_main" in word for word in w.cmdline())]


def main() -> None:
    """Measure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--hours", type=float, default=4.0, help="of stream")
    args = parser.parse_args()
    with browser() as opened:
        if args.seconds:
            smoothness(opened, args.seconds)
        if args.hours:
            memory(opened, args.hours)


if __name__ == "__main__":
    main()
