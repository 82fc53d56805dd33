"""The two processes of the link, each a loop in real time."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import mujoco
import numpy as np

from mplearn.errors import InvalidValueError
from mplearn.generation import retime
from mplearn.generation.joins import drawn_from
from mplearn.recording import FloatArray
from mplearn_envs.data.library_source import LibrarySource
from mplearn_envs.execution.simulation import Simulation
from mplearn_envs.mechanics import rest_reference
from mplearn_envs.robot import Robot, make_robot
from mplearn_envs.skills.skills import Skills

from .disturbance import Disturbance, DisturbedSender
from .lower_body import LowerBody
from .receiver import LinkCounts, Receiver
from .sockets import HOST, PORT
from .upper_body import UpperBody

PATH = ("both arms raise", "both arms lower", "bow down", "bow up", "squat down", "squat raise")
_REST_S = 2.0  # how long the lower body goes on after the last posture
_START_S = 0.3  # how long the upper body sends the first posture
_BLEND_S = 0.5  # within which the first primitive passes from rest into its own course
_DROP_M = 0.2  # below the reference it has fallen


class LinkReport(NamedTuple):
    """What happened in the lower body's process.

    Attributes:
        counts: What came of the datagrams.
        spent_s: Time spent waiting, following, holding and settling [s].
        fallen: Whether the robot fell.
        outside: How many commands were outside the joints' limits of position.
        hasty: How many were outside those of velocity or acceleration.
        slowest_period_s: Longest computation of one period [s].
    """

    counts: LinkCounts
    spent_s: dict[str, float]
    fallen: bool
    outside: int
    hasty: int
    slowest_period_s: float

    def table(self) -> str:
        """Return the report as lines of text."""
        lines = [f"{name:>12} {value}" for name, value in vars(self.counts).items()]
        lines += [f"{name:>12} {value:.2f} s" for name, value in self.spent_s.items()]
        lines.append(f"{'fallen':>12} {'yes' if self.fallen else 'no'}")
        lines.append(f"{'outside':>12} {self.outside}")
        lines.append(f"{'hasty':>12} {self.hasty}")
        lines.append(f"{'period':>12} {1e3 * self.slowest_period_s:.1f} ms at most")
        return "\n".join(lines)


def run_upper(
    robot_name: str = "humanoid",
    path: Sequence[str] = PATH,
    host: str = HOST,
    port: int = PORT,
    speed: float = 0.5,
    disturbance: Disturbance | None = None,
    seed: int = 0,
    key: bytes | None = None,
) -> DisturbedSender:
    """Generate a path, track it and send it in real time; returns the closed sender."""
    robot = make_robot(robot_name)
    period_s = float(robot.model().opt.timestep)
    frames = path_frames(robot, path, speed, period_s)
    rng = np.random.default_rng(seed)
    with DisturbedSender(robot, disturbance or Disturbance(), rng, host, port, key=key) as sender:
        upper = UpperBody(robot, sender, period_s)
        n_waiting = round(_START_S / period_s)
        for k, due_s in _periods(period_s, n_waiting + len(frames)):
            at = max(k - n_waiting, 0)
            upper.update(frames[at], due_s, at == len(frames) - 1)
    return sender


def run_lower(
    robot_name: str = "humanoid",
    host: str = HOST,
    port: int = PORT,
    seconds: float | None = None,
    on_ready: Callable[[], object] = lambda: None,
    key: bytes | None = None,
) -> LinkReport:
    """Balance the simulated robot in real time until the stream is over, or time is up.

    ``on_ready`` is called when it begins to listen.
    """
    if seconds is not None and not 0 < seconds < np.inf:
        raise InvalidValueError(f"seconds must be positive, not {seconds}")
    robot = make_robot(robot_name)
    simulation = Simulation(robot)
    simulation.reset()
    model, data = simulation.model, simulation.data
    period_s = float(model.opt.timestep)
    outside, hasty, slowest_s, fallen = 0, 0, 0.0, False
    recent: deque[FloatArray] = deque(maxlen=3)
    n_periods = None if seconds is None else round(seconds / period_s)
    with Receiver(robot, host, port, key=key) as receiver:
        lower = LowerBody(robot, receiver, period_s)
        lower.update(time.monotonic())  # compiles, before it matters
        on_ready()
        for _ in _periods(period_s, n_periods):
            begin = time.perf_counter()
            commands = lower.update(time.monotonic())
            recent.append(commands)
            outside += _beyond(lower, recent, 0)
            hasty += _beyond(lower, recent, 1) + _beyond(lower, recent, 2)
            data.ctrl[:] = commands
            mujoco.mj_step(model, data)
            slowest_s = max(slowest_s, time.perf_counter() - begin)
            fallen = fallen or not data.qpos[2] > lower.controller.reference.q[2] - _DROP_M
            if lower.phase == "settling" and lower.spent_s["settling"] >= _REST_S:
                break
    spent_s = {str(phase): spent for phase, spent in lower.spent_s.items()}
    return LinkReport(receiver.counts, spent_s, fallen, outside, hasty, slowest_s)


def _beyond(lower: LowerBody, recent: Sequence[FloatArray], order: int) -> int:
    """Return how many of the newest commands are outside the limits of a derivative."""
    newest = np.array(recent)[-1 - order :]
    return lower.limiter.use(newest).outside[order] if len(newest) > order else 0


def path_frames(robot: Robot, path: Sequence[str], speed: float, period_s: float) -> FloatArray:
    """Return a path of the built-in library, frame by frame, as the robot performs it from rest.

    Shape (T, 3 + n) [m, rad], one frame a period.
    """
    library = LibrarySource(None).now()
    ids = [library[name].id for name in path]
    motion = library.generate(ids, style="smooth", rate_hz=1.0 / period_s)
    motion = retime(motion, speed=speed)
    frames = Skills(library, robot).frames_of(motion)
    rest = np.zeros(frames.shape[1])
    rest[0] = rest_reference(robot).target[0]
    return drawn_from(frames, rest, np.zeros_like(rest), 1.0 / period_s, _BLEND_S)


def _periods(period_s: float, n: int | None) -> Iterator[tuple[int, float]]:
    """Yield 0, 1, 2, ... and when each period is due; late ones follow at once."""
    begin = time.monotonic()
    k = 0
    while n is None or k < n:
        due_s = begin + k * period_s
        wait_s = due_s - time.monotonic()
        if wait_s > 0:
            time.sleep(wait_s)
        yield k, due_s
        k += 1
