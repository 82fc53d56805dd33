"""How smooth and steady the page is: ``python -m benchmarks.live_page --seconds 20 --minutes 2``.

In headless Chromium: pictures a second while learning runs at 100 Hz, the time from a click to the
moving figure, and the memory of all processes while an accelerated demonstrator goes on.
"""

from __future__ import annotations

import argparse
import os
import statistics
import time
from typing import Any

from .teaching_session import browser, live, until

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


def memory(opened: Any, minutes: float, speed: float) -> None:
    """Print the memory of each process, and of the page, while time goes by."""
    with live("demonstrator", "--speed", f"{speed:g}") as (url, process):
        page = opened.new_page(viewport={"width": 1280, "height": 720})
        page.goto(url)
        until(lambda: page.locator("#tree .row").count() >= 3, 300, "three primitives")
        end, began = time.monotonic() + 60 * minutes, time.monotonic()
        while time.monotonic() < end:
            page.wait_for_timeout(60_000 * minutes / 6)
            used = [_megabytes(pid) for pid in (process.pid, *_children(process.pid))]
            heap = page.evaluate("performance.memory.usedJSHeapSize") / 1e6
            passed_h = page.evaluate("document.querySelector('#log time')?.textContent ?? ''")
            print(
                f"after {time.monotonic() - began:4.0f} s (stream {passed_h}): processes "
                f"{', '.join(f'{mb:.0f}' for mb in used)} MB, page {heap:.1f} MB, "
                f"{page.locator('#tree .row').count()} primitives"
            )


def _children(pid: int) -> list[int]:
    with open(f"/proc/{pid}/task/{pid}/children", encoding="ascii") as file:  # noqa: PTH123
        return [int(word) for word in file.read().split()]


def _megabytes(pid: int) -> float:
    with open(f"/proc/{pid}/statm", encoding="ascii") as file:  # noqa: PTH123
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def main() -> None:
    """Measure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--minutes", type=float, default=2.0)
    parser.add_argument("--speed", type=float, default=100.0)
    args = parser.parse_args()
    with browser() as opened:
        if args.seconds:
            smoothness(opened, args.seconds)
        if args.minutes:
            memory(opened, args.minutes, args.speed)


if __name__ == "__main__":
    main()
