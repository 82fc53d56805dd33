"""The demo's report: what was learned and performed, beside the paper's figures."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from mplearn.demonstrator import PRIMITIVES
from mplearn.evaluation.table import percent
from mplearn_agents.report.figures import (
    StripSegment,
    data_uri,
    draw_progress,
    draw_stream,
    figure_style,
    readable,
)
from mplearn_agents.report.library_page import library_figures, show
from mplearn_agents.report.page import Column, Number, Page, Rate, Row, Step, Walk
from mplearn_agents.terminal.tables import most_active

from .performance import PLAYBACK, Film

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from mplearn.demonstrator import Demonstration
    from mplearn.library import Primitive, PrimitiveLibrary
    from mplearn_agents.learning.watched import LearningLog
    from mplearn_agents.walk import WalkResult

    from .score import Score

_STRIP_S = 36.0


@dataclass(frozen=True)
class Run:
    """One run of the demo.

    Attributes:
        demonstration: What the person did.
        log: What the learner said.
        library: What it learned, primitives named by what a person would call them.
        score: That against the truth.
        walk: What the robot did.
        film: Its pictures; None where none could be drawn.
        without_film: Why not; empty where they could.
        seed: Of everything random.
    """

    demonstration: Demonstration
    log: LearningLog
    library: PrimitiveLibrary
    score: Score
    walk: WalkResult
    film: Film | None
    without_film: str
    seed: int


def meaning(label: str) -> str:
    """Return what a person would call a class of the demonstrator."""
    return PRIMITIVES[label].meaning if label in PRIMITIVES else label


def demo_page(run: Run, folder: Path) -> Page:
    """Return the report's content, and write its figures as PNG files.

    Args:
        run: What happened.
        folder: Where the PNG files go.
    """
    score, log, walk = run.score, run.log, run.walk
    rates = score.rates
    n_classes = len(score.performed)
    minutes = log.watched_s / 60
    names = {primitive.id: primitive.name for primitive in run.library.primitives}
    figures = library_figures(run.library, names, folder)
    with figure_style():
        figures["progress"] = show(
            draw_progress(
                [(frame / _rate_hz(run), count) for frame, count in log.known],
                [(s.end / _rate_hz(run), s.start in log.recognised) for s in log.moving],
                n_classes,
            ),
            "progress",
            "A primitive is known once it was demonstrated a few times (left); from then on it is "
            "recognised when it comes again (right).",
            folder,
        )
        figures["stream"] = show(
            _strip(run),
            "stream",
            "Joint angles of the person, what the learner found below, and what was performed: "
            "blue was recognised rightly, orange wrongly, hatched was not recognised.",
            folder,
        )
    return Page(
        title="A humanoid learns motion primitives by watching a person",
        lead=(
            f"A person with 34 markers performed {n_classes} kinds of motion for {minutes:.1f} "
            "minutes. The stream was cut, clustered and ordered while it went on, frame by frame "
            "and without labels; then the robot walked the graph that came out of it."
        ),
        numbers=(
            Number(f"{minutes:.1f} min", "of motion watched", f"{len(log.moving)} segments found"),
            Number(f"{log.times_real_time:.0f} x", "real time", "markers to graph, one core"),
            Number(
                f"{len(rates.extracted)} of {n_classes}", "primitives learned", "paper: 17 of 22"
            ),
            Number(percent(rates.false_positive), "false positives", "paper: 3.5 %"),
            Number(percent(rates.false_negative), "false negatives", "paper: 6.7 %"),
            Number(str(len(walk.primitives)), "primitives performed", f"{_falls(walk.falls)}"),
        ),
        learned_summary=(
            "A primitive is named after the motion that most of its segments are. Names are for "
            "the reader alone: the learner never saw them."
        ),
        rates=_rates(run),
        rates_note=(
            "A found segment shows the motion with which its intersection over union exceeds 0.5, "
            "boundaries within 0.25 s counting as equal. Rates are shares of all found segments; "
            "coverage counts the motions that lie in a primitive of their class at the end."
        ),
        primitive_columns=(
            Column("motion"),
            Column("id", numeric=True),
            Column("performed", numeric=True),
            Column("recognised", numeric=True),
            Column("right", numeric=True),
            Column("duration", numeric=True),
            Column("most active"),
        ),
        primitives=_rows(run),
        figures=figures,
        walk=_walk(run),
        footer=(
            f"Synthetic demonstrator, seed {run.seed}; library version {run.library.version}. "
            "The paper: D. Kulić, C. Ott, D. Lee, J. Ishikawa, Y. Nakamura, Incremental learning "
            "of full body motion primitives and their sequencing through human motion "
            "observation, IJRR 31(3), 2012; its session lasted 16 minutes."
        ),
    )


def _rates(run: Run) -> tuple[Rate, ...]:
    rates = run.score.rates

    def row(name: str, here: str, paper: str, better: bool) -> Rate:
        return Rate(name, here, paper, "better" if better else "worse")

    n_extracted, n_classes = len(rates.extracted), rates.n_classes
    return (
        row(
            "primitives learned",
            f"{n_extracted} of {n_classes}",
            "17 of 22",
            n_extracted / n_classes >= 17 / 22,
        ),
        row("spurious primitives", str(rates.n_spurious), "0", rates.n_spurious == 0),
        row(
            "false positives: recognised as something else",
            percent(rates.false_positive),
            "3.5 %",
            rates.false_positive <= 0.035,
        ),
        row(
            "false negatives: known, yet not recognised",
            percent(rates.false_negative),
            "6.7 %",
            rates.false_negative <= 0.067,
        ),
        row(
            "coverage: motions that a primitive stands for",
            percent(rates.coverage),
            "77 %",
            rates.coverage >= 0.77,
        ),
    )


def _rows(run: Run) -> tuple[Row, ...]:
    score, rows = run.score, []
    for label, count in score.performed.items():
        learned = [p for p in run.library.primitives if score.classes.get(p.id) == label]
        if not learned:
            rows.append(Row((meaning(label), "-", str(count), "", "", "", "not learned"), True))
        rows += [_row(run, primitive, label) for primitive in learned]
    return tuple(rows)


def _row(run: Run, primitive: Primitive, label: str) -> Row:
    cells = (
        meaning(label),
        str(primitive.id),
        str(run.score.performed[label]),
        str(run.score.recognised[primitive.id]),
        str(run.score.right[primitive.id]),
        f"{primitive.mean_duration_s:.2f} s",
        ", ".join(map(readable, most_active(primitive, run.library.channels))),
    )
    return Row(cells)


def _walk(run: Run) -> Walk:
    walk, film = run.walk, run.film
    return Walk(
        summary=(
            f"A random walk of {len(walk.primitives)} primitives, each drawn as often as it "
            f"followed the one before: {walk.duration_s:.0f} seconds at half the person's speed, "
            f"{_falls(walk.falls)}. Arms and trunk follow the primitives, the legs balance "
            "and lift a foot where the motion does."
        ),
        steps=tuple(Step(step.name, step.duration_s, step.fallen) for step in walk.steps),
        video=data_uri(film.video.read_bytes(), "video/mp4") if film else "",
        video_caption=(
            "The robot, and beside it the person doing the same: for each primitive one of the "
            "demonstrations, stretched to the robot's time. Played at "
            f"{PLAYBACK} times the robot's pace."
        ),
        film=film.stills if film else (),
        missing=run.without_film,
    )


def _strip(run: Run) -> Figure:
    recording = run.demonstration.recording
    rate_hz = recording.rate_hz
    n_frames = min(round(_STRIP_S * rate_hz), len(recording))
    first = max(0, round(0.72 * len(recording)) - n_frames // 2)
    last = first + n_frames
    score, log = run.score, run.log
    found = []
    for segment in log.moving:
        primitive = log.recognised.get(segment.start)
        label = score.classes.get(primitive, "") if primitive is not None else ""
        right = label and score.shows.get(segment.start) == label
        found.append(
            StripSegment(
                segment.start / rate_hz,
                segment.end / rate_hz,
                meaning(label),
                "unknown" if primitive is None else "right" if right else "wrong",
            )
        )
    truth = [
        StripSegment(s.start / rate_hz, s.end / rate_hz, meaning(s.label), "truth")
        for s in run.demonstration.truth
    ]
    angles = run.demonstration.posture.frames[first:last, 7:]
    return draw_stream(angles, first / rate_hz, rate_hz, found, truth)


def _rate_hz(run: Run) -> float:
    return run.demonstration.recording.rate_hz


def _falls(n: int) -> str:
    return "no fall" if n == 0 else "1 fall" if n == 1 else f"{n} falls"
