"""Experiment 4.1 of [Kulic2012] on the page, with a synthetic demonstrator and a real browser.

Four primitives are taught (both arms raise and lower, bend down and return); the teacher goes on
when the page says that they are learned. Then their sequencing is taught. At the end tree and
graph are those of figures 6 and 7. ``python -m benchmarks.teaching_session --out FOLDER`` writes
pictures; ``--film FILE`` also a film of the page, from the first frame to the walk.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from base64 import b64decode
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from mplearn.demonstrator import Demonstrator
from mplearn.recording import LabelledSegment
from mplearn.sources import Block, Stream
from mplearn.sources.sending import open_sender
from mplearn_agents.terminal.interrupts import interrupted

NAMES = {
    "BAR": "both arms raise",
    "BAL": "both arms lower",
    "BAD": "bend down",
    "BAU": "bend return",
}
MOST_REPEATS = 20
AT_ONCE = 25  # frames that are sent together
PATIENCE_S = 600.0  # for what comes later on a busy machine, but comes
ARMS, BENDS = ("BAR", "BAL"), ("BAD", "BAU")
SEQUENCE = (*ARMS, *BENDS, *BENDS, *ARMS, *ARMS, *BENDS, *ARMS, *BENDS, *BENDS, *ARMS)


def chromium() -> str | None:
    """Return where Chromium is; None where there is none."""
    return shutil.which("chromium") or shutil.which("chromium-browser")


@contextmanager
def browser() -> Iterator[Any]:
    """Open a headless browser."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        opened = playwright.chromium.launch(
            executable_path=chromium(), args=["--no-sandbox", "--disable-dev-shm-usage"]
        )
        try:
            yield opened
        finally:
            opened.close()


@contextmanager
def live(*options: str) -> Iterator[tuple[str, subprocess.Popen[str]]]:
    """Run ``mplearn live`` and yield the page's address, and the process.

    It ends with this, also where SIGTERM ends this.
    """
    command = [sys.executable, "-m", "mplearn_agents.cli", "live", *options, "--port", "0"]
    with interrupted():
        process = subprocess.Popen(
            command, stdout=subprocess.PIPE, text=True, start_new_session=True
        )
        try:
            assert process.stdout is not None
            words = process.stdout.readline().split()
            if not words:
                raise RuntimeError(f"{' '.join(command)} did not start")
            yield words[1], process
        finally:
            process.send_signal(signal.SIGINT)
            try:
                process.wait(20)
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
            assert process.stdout is not None
            process.stdout.close()


def until(check: Callable[[], Any], timeout_s: float = PATIENCE_S, what: str = "") -> Any:
    """Return what ``check`` returns as soon as that is something."""
    end = time.monotonic() + timeout_s
    while True:
        found = check()
        if found:
            return found
        if time.monotonic() > end:
            raise TimeoutError(f"{what or check} within {timeout_s} s")
        time.sleep(0.03)


def drawn_seldom(page: Any) -> None:
    """Draw a page four times a second: without a graphics card sixty cost a core."""
    page.add_init_script(
        "window.requestAnimationFrame = (f) => setTimeout(() => f(performance.now()), 250)"
    )


class Teacher:
    """Stands before the cameras and looks at the page.

    Args:
        page: The page.
        speed: Times as fast as a person.
        seed: Of everything random.
    """

    def __init__(self, page: Any, speed: float, seed: int = 0) -> None:
        self.page, self.speed = page, speed
        self.demonstrator = Demonstrator(seed=seed)
        self.shown: list[str] = []
        self.truth: list[LabelledSegment] = []
        self.segments: list[dict[str, Any]] = []
        self.moments: dict[str, float] = {}
        page.on("websocket", lambda socket: socket.on("framereceived", self._hear))

    def _hear(self, message: str | bytes) -> None:
        if isinstance(message, str) and message.startswith('{"kind":"segment"'):
            self.segments.append(json.loads(message))

    def learned(self) -> tuple[int, int]:
        """Return how many primitives the page says are learned, and how many are not sure."""
        words = self.page.locator("#progress .sum").inner_text().split()
        numbers = [int(word) for word in words if word.isdigit()]
        sure, young = (*numbers, 0, 0)[:2]
        return sure, young

    def listening(self) -> str | None:
        """Return where frames go, as soon as the page says that they are waited for."""
        state = self.page.locator("#state").text_content()
        found = re.fullmatch(r"(ndjson:\S+) — waiting for frames", state)
        return found and str(found[1])

    def followed(self, n_frames: int) -> bool:
        """Return whether the page says that so many frames were learned from."""
        return int(self.page.locator("html").get_attribute("data-frames") or 0) >= n_frames

    def standing(self) -> bool:
        """Return whether the page shows the robot."""
        return self.page.locator("html").get_attribute("data-figures") == "there"

    def teach(self, script: Iterator[str], to: str) -> None:
        """Perform a script, which may look at the page between its motions.

        Each motion begins when the page has followed the last one, however busy the machine is.

        Args:
            script: Names of what is performed.
            to: Where the frames go.
        """
        demonstrator = self.demonstrator
        stream = Stream(demonstrator.channels, demonstrator.rate_hz, unit_m=1.0, up="z")
        n = 0
        with open_sender(to) as sender:
            due = time.monotonic()
            for block in demonstrator.blocks(script):
                frames = block.markers.reshape(len(block.markers), -1)
                self.truth += block.truth
                for first in range(0, len(frames), AT_ONCE):
                    part = frames[first : first + AT_ONCE]
                    times = (n + np.arange(len(part))) / demonstrator.rate_hz
                    sender.send(Block(stream, part, times, np.zeros(len(part))))
                    n += len(part)
                    due = max(due + len(part) / demonstrator.rate_hz / self.speed, time.monotonic())
                    self.page.wait_for_timeout(max(0.0, 1000 * (due - time.monotonic())))
                until(lambda n=n: self.followed(n), what=f"{n} frames are learned from")

    def script(self, picture: Callable[[str], None]) -> Iterator[str]:
        """Yield what is shown: each pair until the page says that it is learned, then sequences."""
        for k, (there, back) in enumerate((ARMS, BENDS)):
            for repeat in range(MOST_REPEATS):
                if self.learned() == (2 * k + 2, 0):
                    break
                if (k, repeat) == (0, 3):
                    picture("teaching")
                for name in (there, back):
                    self.shown.append(name)
                    yield name
            picture(("arms", "bends")[k])
        for k, name in enumerate(SEQUENCE):
            if k == len(SEQUENCE) // 2:
                picture("sequencing")
            self.shown.append(name)
            yield name

    def meanings(self) -> dict[int, str]:
        """Return what each primitive is, by what was performed while it was recognised."""
        votes: dict[int, Counter[str]] = {}
        for segment in self.segments:
            if segment["primitive"] is None:
                continue
            for true in self.truth:
                shared = min(true.end, segment["end"]) - max(true.start, segment["start"])
                if shared > 0.6 * (true.end - true.start):
                    votes.setdefault(segment["primitive"], Counter())[true.label] += 1
        return {id: found.most_common(1)[0][0] for id, found in votes.items()}

    def name(self, id: int, name: str) -> None:
        """Give a primitive a name, by keyboard."""
        self.page.locator(f'#tree [data-id="{id}"]').click()
        self.page.keyboard.press("n")
        self.page.keyboard.insert_text(name)
        self.page.keyboard.press("Enter")
        row = self.page.locator(f'#tree [data-id="{id}"] text.name', has_text=name)
        row.wait_for(timeout=1000 * PATIENCE_S)
        self.page.keyboard.press("Escape")


def session(
    opened: Any,
    *,
    speed: float,
    picture: Callable[[Any, str], None] = lambda page, name: None,
    size: tuple[int, int] = (1280, 720),
    theme: str = "light",
    begin: Callable[[Any], None] = lambda page: None,
    end: Callable[[Any], None] = lambda page: None,
) -> dict[str, Any]:
    """Replay the experiment; return what the page shows at its end.

    Args:
        opened: The browser.
        speed: Times as fast as a person.
        picture: Takes the page at certain moments, and what they are called.
        size: Of the page [px].
        theme: Light or dark.
        begin: What is done to the page before it is opened.
        end: What else is done on it at the end.
    """
    with live("ndjson:0") as (url, _):
        page = opened.new_page(viewport={"width": size[0], "height": size[1]})
        page.add_init_script(f"localStorage.theme ||= '{theme}'")
        begin(page)
        teacher = Teacher(page, speed)
        page.goto(url)
        to = until(teacher.listening, what="the learner waits for frames")
        until(teacher.standing, what="the robot stands there")
        picture(page, "begin")
        teacher.teach(teacher.script(lambda name: picture(page, name)), to)
        until(lambda: len(teacher.meanings()) >= 4, what="four primitives")
        meanings = teacher.meanings()
        for id, label in meanings.items():
            teacher.name(id, NAMES[label])
        page.wait_for_timeout(1500)
        picture(page, "learned")
        page.keyboard.press("w")
        root = page.locator("html")
        until(lambda: root.get_attribute("data-robot"), what="the robot walks")
        page.wait_for_timeout(1500)
        picture(page, "walk")
        end(page)
        found = {
            "tree": page.locator("#tree text.name").all_text_contents(),
            "graph": page.locator("#graph .node text").all_text_contents(),
            "edges": page.evaluate(
                "[...document.querySelectorAll('#graph .edge title')].map((e) => e.textContent)"
            ),
            "learned": teacher.learned(),
            "meanings": {id: NAMES[label] for id, label in meanings.items()},
            "shown": Counter(teacher.shown),
        }
        page.close()
        return found


class Film:
    """What a page shows, as a film: a picture at each moment of an even clock.

    Args:
        path: The file, .mp4.
        fps: Pictures per second [1/s].
    """

    def __init__(self, path: Path, fps: float = 12.0) -> None:
        self.path, self.fps = path, fps
        self._pictures: list[tuple[float, bytes]] = []

    def begin(self, page: Any) -> None:
        """Take each picture that the browser draws of a page, from now on."""
        cast = page.context.new_cdp_session(page)

        def take(drawn: dict[str, Any]) -> None:
            self._pictures.append((drawn["metadata"]["timestamp"], b64decode(drawn["data"])))
            with suppress(Exception):  # of playwright: the page may be closed by now
                cast.send("Page.screencastFrameAck", {"sessionId": drawn["sessionId"]})

        cast.on("Page.screencastFrame", take)
        cast.send("Page.startScreencast", {"format": "jpeg", "quality": 92})

    def write(self) -> float:
        """Write the film, from the first picture that shows something; return its length [s]."""
        import imageio_ffmpeg

        def shown(data: bytes) -> Image.Image:
            return Image.open(BytesIO(data)).convert("RGB")

        drawn = (shown(data).getextrema() for _, data in self._pictures)
        first = next(k for k, bands in enumerate(drawn) if any(low < high for low, high in bands))
        times = np.array([at for at, _ in self._pictures[first:]]) - self._pictures[first][0]
        writer = imageio_ffmpeg.write_frames(
            str(self.path),
            shown(self._pictures[first][1]).size,
            fps=self.fps,
            quality=None,
            macro_block_size=2,
            output_params=["-crf", "30", "-preset", "veryfast", "-movflags", "+faststart"],
        )
        writer.send(None)
        for at in np.arange(0.0, times[-1], 1.0 / self.fps):
            _, data = self._pictures[first + int(np.searchsorted(times, at, "right")) - 1]
            writer.send(np.asarray(shown(data)).tobytes())
        writer.close()
        return float(times[-1])


def main() -> None:
    """Replay the experiment and write pictures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--speed", type=float, default=4.0)
    parser.add_argument("--width", type=int, default=1280)
    parser.add_argument("--height", type=int, default=720)
    parser.add_argument("--theme", choices=["light", "dark"], default="light")
    parser.add_argument("--film", type=Path, help="film to write, .mp4")
    args = parser.parse_args()
    film = None if args.film is None else Film(args.film)
    args.out.mkdir(parents=True, exist_ok=True)

    def picture(page: Any, name: str) -> None:
        image = Image.open(BytesIO(page.screenshot()))
        image.save(args.out / f"session-{name}.webp", quality=82, method=6)

    def end(page: Any) -> None:
        """Look at a primitive, and then at the screen that is read from afar."""
        page.keyboard.press("x")
        page.locator("#tree .row").first.click()
        root = page.locator("html")
        until(lambda: root.get_attribute("data-shown"), what="the figure")
        until(lambda: root.get_attribute("data-robot"), what="the robot performs it")
        page.wait_for_timeout(700)
        picture(page, "click")
        page.keyboard.press("Escape")
        page.keyboard.press("f")
        page.wait_for_timeout(700)
        picture(page, "screen")

    with browser() as opened:
        found = session(
            opened,
            speed=args.speed,
            picture=picture,
            size=(args.width, args.height),
            theme=args.theme,
            begin=(lambda page: None) if film is None else film.begin,
            end=end,
        )
    if film is not None:
        print(f"film of {film.write():.0f} s: {args.film}")
    for key, value in found.items():
        print(f"{key}: {value}")


if __name__ == "__main__":
    main()
