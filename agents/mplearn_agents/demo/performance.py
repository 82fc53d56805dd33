"""The demo's walk, and its film with the demonstrator beside the robot."""

from __future__ import annotations

import io
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mplearn.extras import require
from mplearn_agents.film import accompany, film, middle_pictures, with_captions
from mplearn_agents.policies import RandomWalk
from mplearn_agents.report.figures import data_uri
from mplearn_agents.report.page import Still
from mplearn_agents.video import write_video
from mplearn_agents.walk import WalkResult, walk

if TYPE_CHECKING:
    from rich.console import Console

    from mplearn.demonstrator import Demonstration
    from mplearn.library import PrimitiveLibrary
    from mplearn_envs.robot import Robot

#: The film plays at twice the robot's pace: the robot moves at half the person's.
PLAYBACK = 2
_FILM_HZ = 25.0
_STILLS = 12


@dataclass(frozen=True)
class Film:
    """What was drawn of a walk.

    Attributes:
        video: The file.
        stills: Pictures for the film strip.
    """

    video: Path
    stills: tuple[Still, ...]


def perform(library: PrimitiveLibrary, steps: int, seed: int) -> tuple[WalkResult, Robot]:
    """Let the humanoid walk the graph at random, recording its postures."""
    import gymnasium

    import mplearn_envs  # noqa: F401  (registers the environment)

    env = gymnasium.make(
        "mplearn/PrimitiveHumanoid-v0",
        library=library,
        pictures={"frame_rate_hz": _FILM_HZ / PLAYBACK},
    )
    result = walk(env, RandomWalk(), steps, seed, record=True)
    robot: Robot = env.unwrapped.robot  # type: ignore[attr-defined]
    env.close()
    return result, robot


def make_film(
    result: WalkResult,
    robot: Robot,
    demonstration: Demonstration,
    classes: Mapping[int, str],
    folder: Path,
    console: Console,
) -> Film:
    """Draw the robot beside the person who performs the same, and write ``walk.mp4``.

    Args:
        result: The walk.
        robot: Who walked.
        demonstration: What the person did, from which her motions are taken.
        classes: Class of each primitive that the walk performs.
        folder: Where ``walk.mp4`` and ``film.png`` go.
        console: Where progress is shown.

    Raises:
        MissingDependencyError: There is no off-screen renderer, or no imageio-ffmpeg.
    """
    from mplearn.body import human_body
    from mplearn_agents.terminal.progress import tracked

    counts = np.bincount(result.step_of, minlength=len(result.steps))
    steps = [
        ("" if step.primitive is None else classes.get(step.primitive, ""), int(count))
        for step, count in zip(result.steps, counts, strict=True)
    ]
    body = human_body()
    posture = demonstration.posture.frames
    person = (body, accompany(body, posture, demonstration.truth, steps))
    middles = middle_pictures(result)
    wanted = dict(list({index: k for k, index in middles.items()}.items())[:_STILLS])
    kept: dict[int, NDArray[np.uint8]] = {}

    def keeping(pictures: Iterable[NDArray[np.uint8]]) -> Iterator[NDArray[np.uint8]]:
        for index, picture in enumerate(pictures):
            if index in wanted:
                kept[index] = picture
            yield picture

    names = [step.name for step in result.steps]
    pictures = with_captions(keeping(film(result, robot.xml, person)), result, names)
    video = folder / "walk.mp4"
    shown = tracked(pictures, len(result.postures), "filming", console)
    write_video(video, shown, _FILM_HZ)
    _write_strip(list(kept.values()), folder / "film.png")
    stills = tuple(
        Still(_jpeg_uri(picture), names[wanted[index]], index / result.rate_hz)
        for index, picture in kept.items()
    )
    return Film(video, stills)


def _write_strip(pictures: list[NDArray[np.uint8]], path: Path) -> None:
    half = pictures[0][::2, ::2]
    blank = np.full_like(half, 255)
    small = [picture[::2, ::2] for picture in pictures]
    small += [blank] * (-len(small) % 6)
    rows = [np.concatenate(small[k : k + 6], axis=1) for k in range(0, len(small), 6)]
    require("PIL.Image", "report").fromarray(np.concatenate(rows)).save(path)


def _jpeg_uri(picture: NDArray[np.uint8]) -> str:
    buffer = io.BytesIO()
    require("PIL.Image", "report").fromarray(picture).save(buffer, format="JPEG", quality=82)
    return data_uri(buffer.getvalue(), "image/jpeg")
