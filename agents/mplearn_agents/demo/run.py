"""Runs the demo: watch, learn, compare, perform, report."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from mplearn.errors import InvalidValueError
from mplearn.extras import require
from mplearn_agents.learning.watched import learn
from mplearn_agents.report import render_page
from mplearn_agents.terminal.console import heading
from mplearn_envs.rendering.backend import choose_backend

from .page import Run, demo_page, meaning
from .performance import make_film, perform
from .score import score_learning

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from mplearn.library import PrimitiveLibrary
    from mplearn_agents.report import Page

_MEAN_SEGMENT_S = 1.28
_WARM_UP_FRAMES = 2500  # enough for a first primitive: what is compiled is not counted as learning


def run_demo(out: Path, minutes: float, steps: int, seed: int, console: Console) -> Path:
    """Run the whole chain and return the report.

    Args:
        out: Folder for ``report.html``, ``library.mplearn``, ``walk.mp4`` and the figures.
        minutes: How long the person demonstrates [min].
        steps: How many primitives the robot performs.
        seed: Of everything random.
        console: Where progress and tables go.

    Raises:
        InvalidValueError: ``minutes`` does not lie in (0, 60].
        MissingDependencyError: The extra "report" is not installed.
    """
    if not 0.0 < minutes <= 60.0:
        raise InvalidValueError(f"minutes must lie in (0, 60], not {minutes}")
    for module in ("matplotlib", "jinja2", "imageio_ffmpeg"):
        require(module, "report")
    can_draw = choose_backend()  # before anything imports mujoco

    from mplearn.demonstrator import PAPER_PRIMITIVES, demonstrate, markov_script
    from mplearn.learner import LearnerConfig, MotionLearner

    begin = time.perf_counter()
    out.mkdir(parents=True, exist_ok=True)
    length = max(2, round(60.0 * minutes / _MEAN_SEGMENT_S))
    script = markov_script(length, np.random.default_rng(seed), balance=0.5)
    demonstration = demonstrate(script, seed)
    recording = demonstration.recording
    text = (
        f"a person with {len(recording.marker_names)} markers perform "
        f"{len(PAPER_PRIMITIVES)} kinds of motion for {recording.duration_s / 60:.1f} minutes"
    )
    console.print(heading("watching", text))
    config = LearnerConfig(recording.channels, recording.rate_hz)
    with console.status("compiling, the first time only"):
        MotionLearner(config).learn_many(recording.frames[:_WARM_UP_FRAMES])
    learner = MotionLearner(config)
    log = learn(learner, [recording], console)
    library = learner.snapshot()
    score = score_learning(log, demonstration.truth, recording.rate_hz)
    library = _named(library, score.classes)
    library.save(out / "library.mplearn")

    walked, robot = perform(library, steps, seed)
    text = (
        f"{len(walked.primitives)} primitives in {walked.duration_s:.0f} s of "
        f"the robot's time, {walked.falls} falls: {', '.join(step.name for step in walked.steps)}"
    )
    console.print(heading("walking", text))
    film, without_film = None, ""
    if can_draw:
        film = make_film(walked, robot, demonstration, score.classes, out, console)
    else:
        without_film = (
            "There is no off-screen renderer on this machine, so there is neither film nor video: "
            "install libegl1 and libgl1-mesa-dri, or libosmesa6."
        )
        console.print(without_film, style="yellow")
    run = Run(demonstration, log, library, score, walked, film, without_film, seed)
    page = demo_page(run, out)
    report = out / "report.html"
    report.write_text(render_page(page), encoding="utf-8")
    for table in tables(page):
        console.print(table)
    console.print(heading("report", f"{report}, after {time.perf_counter() - begin:.0f} s"))
    text = "watch it learn, and teach it, in the browser: mplearn live"
    console.print(heading("next", text))
    return report


def tables(page: Page) -> Iterator[Table]:
    """Yield the report's two tables for the console."""
    from rich.table import Table
    from rich.text import Text

    learned = Table(title="what was learned, against the truth", title_justify="left")
    for column in page.primitive_columns[:-1]:
        learned.add_column(column.name, justify="right" if column.numeric else "left", no_wrap=True)
    for row in page.primitives:
        learned.add_row(*map(Text, row.cells[:-1]), style="dim" if row.absent else None)
    yield learned
    rates = Table(title="against the paper", title_justify="left")
    rates.add_column("measure")
    rates.add_column("this run", justify="right")
    rates.add_column("the paper", justify="right")
    for rate in page.rates:
        style = {"better": "green", "worse": "red", "": ""}[rate.verdict]
        rates.add_row(rate.name, Text(rate.here, style), rate.paper)
    yield rates


def _named(library: PrimitiveLibrary, classes: Mapping[int, str]) -> PrimitiveLibrary:
    """Name each primitive after its class; a second one of a class gets a number."""
    seen: Counter[str] = Counter()
    for id, label in classes.items():
        seen[label] += 1
        name = meaning(label) + (f" {seen[label]}" if seen[label] > 1 else "")
        library = library.rename(id, name)
    return library
