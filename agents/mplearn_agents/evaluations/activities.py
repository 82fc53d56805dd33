"""Experiments on recordings whose labels are activities, coarser than primitives."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from .setting import Setting

if TYPE_CHECKING:
    from mplearn.evaluation import Table


def exercises(setting: Setting) -> Iterator[Table]:
    """Which activities own primitives, learned as they come, at several frame rates."""
    from mplearn.evaluation.experiments import exercise_table

    yield exercise_table(setting.annotated)


def rhythm(setting: Setting) -> Iterator[Table]:
    """Cuts a cycle, and the spread of their phase, in walking and in whatever repeats."""
    from mplearn.evaluation.experiments import rhythm_table

    table = rhythm_table(setting.described)
    if table.rows:
        yield table


def rates(setting: Setting) -> Iterator[Table]:
    """Whether the same motion is cut at the same times at 20 to 250 frames a second."""
    from mplearn.evaluation.experiments import frame_rate_table

    yield frame_rate_table(setting.described)


def loops(setting: Setting) -> Iterator[Table]:
    """A minute of each take played three times in a loop."""
    from mplearn.evaluation.experiments import loop_table

    yield loop_table(setting.described)


def glitches(setting: Setting) -> Iterator[Table]:
    """Recognition after one bad frame, against none."""
    from mplearn.evaluation.experiments import glitch_table

    table = glitch_table(take for take in setting.described if take.is_markers)
    if table.rows:
        yield table


def peers(setting: Setting) -> Iterator[Table]:
    """Segmenters of other libraries on the same takes, where they are installed."""
    from mplearn.evaluation.experiments import segmenter_table

    yield segmenter_table(setting.described)


def activities(setting: Setting) -> Iterator[Table]:
    """Which activity goes on when, the number of activities not given."""
    from mplearn.evaluation.experiments import activity_table

    yield activity_table(setting.takes)


EVALUATIONS = {
    "exercises": exercises,
    "rhythm": rhythm,
    "rates": rates,
    "loops": loops,
    "glitches": glitches,
    "peers": peers,
    "activities": activities,
}
