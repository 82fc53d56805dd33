"""What a mad or hostile upper body may send, to see that the robot stands through it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple, TypeAlias

import mujoco
import numpy as np

from mplearn.recording import FloatArray
from mplearn_envs.execution.simulation import Simulation
from mplearn_envs.mechanics import reference_robot, rest_reference
from mplearn_envs.robot import Robot

from .command_limiter import Use
from .datagram import base_frame
from .lower_body import LowerBody
from .receiver import Receiver
from .sender import Sender

PERIOD_S = 0.004
DROP_M = 0.2  # below the reference it has fallen
_LEANS_RAD = 0.3  # beyond the reference it is about to fall


class Attacker:
    """Makes datagrams for a robot: a sender that never sends, and randomness.

    Args:
        robot: The robot.
        seed: Of the randomness.
    """

    def __init__(self, robot: Robot, seed: int) -> None:
        self.robot = robot
        self.rng = np.random.default_rng(seed)
        self.reference = reference_robot(robot)
        self.rest = rest_reference(robot).target
        self.sender = Sender(robot, stream=int(self.rng.integers(2**32)))

    def datagram(self, posture: FloatArray, time_s: float, *, last: bool = False) -> bytes:
        """Return a well-formed datagram of tracked coordinates, shape (U,)."""
        return self.sender.datagram(base_frame(*posture[:3]), posture[3:], time_s, last)

    def standing(self, **base: float) -> FloatArray:
        """Return the standing posture with another height [m], roll or pitch [rad]."""
        out = self.rest.copy()
        for name, value in base.items():
            out[("height", "roll", "pitch").index(name)] = value
        return out

    def anywhere(self, excess: float = 1.0) -> FloatArray:
        """Return a posture drawn from the limits, widened by a factor."""
        low, high = self.reference.limits.T
        middle, half = 0.5 * (low + high), 0.5 * excess * (high - low)
        return np.asarray(middle + half * self.rng.uniform(-1.0, 1.0, len(low)))


#: Yields what comes in each control period.
Attack: TypeAlias = Callable[[Attacker], Iterator[list[bytes]]]


def _every_period(posture_at: Callable[[Attacker, float], FloatArray]) -> Attack:
    def attack(attacker: Attacker) -> Iterator[list[bytes]]:
        k = 0
        while True:
            yield [attacker.datagram(posture_at(attacker, k * PERIOD_S), k * PERIOD_S)]
            k += 1

    return attack


def _held(posture: Callable[[Attacker], FloatArray]) -> Attack:
    """After a second of standing, one posture for ever."""
    return _every_period(lambda a, t: posture(a) if t >= 1.0 else a.rest)


def _jumping(a: Attacker, t: float) -> FloatArray:
    low, high = a.reference.limits.T
    return np.asarray(high if int(t / 0.5) % 2 else low)


def _shaking(hz: float) -> Attack:
    def at(a: Attacker, t: float) -> FloatArray:
        low, high = a.reference.limits.T
        return np.asarray(0.5 * (low + high) + 0.5 * (high - low) * np.sin(2 * np.pi * hz * t))

    return _every_period(at)


def _waving(hz: float) -> Attack:
    """All upper joints in phase, the base as it stands."""

    def at(a: Attacker, t: float) -> FloatArray:
        low, high = a.reference.limits.T
        out = 0.5 * (low + high) + 0.5 * (high - low) * np.sin(2 * np.pi * hz * t)
        out[:3] = a.rest[:3]
        return np.asarray(out)

    return _every_period(at)


def _random_jumps(each_s: float, excess: float) -> Attack:
    def attack(attacker: Attacker) -> Iterator[list[bytes]]:
        k, posture = 0, attacker.rest
        while True:
            if k % max(1, round(each_s / PERIOD_S)) == 0:
                posture = attacker.anywhere(excess)
            yield [attacker.datagram(posture, k * PERIOD_S)]
            k += 1

    return attack


def _no_time(attacker: Attacker) -> Iterator[list[bytes]]:
    """Time stamps 1e-9 s apart, and postures from one end to the other."""
    k = 0
    while True:
        yield [attacker.datagram(attacker.anywhere(), 1e-9 * (8 * k + i)) for i in range(8)]
        k += 1


def _wild_time(attacker: Attacker) -> Iterator[list[bytes]]:
    """Time stamps that leap, run back and stand."""
    while True:
        time_s = attacker.rng.choice([0.0, -1e300, 1e300, 1e-300, 5.0, attacker.rng.normal()])
        yield [attacker.datagram(attacker.anywhere(), float(time_s))]


def _nan(attacker: Attacker) -> Iterator[list[bytes]]:
    k = 0
    while True:
        posture = attacker.anywhere()
        bad = [np.nan, np.inf, -np.inf, 1e308, -1e308]
        posture[attacker.rng.integers(3, len(posture))] = attacker.rng.choice(bad)
        yield [attacker.datagram(posture, k * PERIOD_S)]
        k += 1


def _replay(attacker: Attacker) -> Iterator[list[bytes]]:
    """A second of another posture, again and again in any order."""
    said = []
    for k in range(250):
        bow = attacker.standing(pitch=1.2 * min(1.0, k / 100))
        said.append(attacker.datagram(bow, k * PERIOD_S, last=k == 249))
        yield said[-1:]
    while True:
        yield [said[i] for i in attacker.rng.integers(0, 250, 4)]


def _takeovers(attacker: Attacker) -> Iterator[list[bytes]]:
    """Many streams, each ended at once so that the next may take over."""
    while True:
        attacker.sender.stream, attacker.sender.sequence = int(attacker.rng.integers(2**32)), 0
        yield [attacker.datagram(attacker.anywhere(), 0.0, last=True)]


def _bursts(attacker: Attacker) -> Iterator[list[bytes]]:
    """Half a second of postures at once, then silence, just as long as it is held or settled."""
    k = 0
    while True:
        posture = attacker.anywhere()
        yield [attacker.datagram(posture, (k + i) * PERIOD_S) for i in range(125)]
        quiet = int(attacker.rng.integers(1, 250))
        for _ in range(quiet):
            yield []
        k += 125 + quiet


def _flood(attacker: Attacker) -> Iterator[list[bytes]]:
    """Rubbish, a hundred datagrams a period, and a posture among it."""
    k = 0
    while True:
        rubbish = [attacker.rng.bytes(int(attacker.rng.integers(0, 300))) for _ in range(100)]
        rubbish[int(attacker.rng.integers(100))] = attacker.datagram(
            attacker.anywhere(), k * PERIOD_S
        )
        yield rubbish
        k += 1


def _random_bytes(attacker: Attacker) -> Iterator[list[bytes]]:
    """Random bytes, and whole datagrams with bytes changed."""
    k = 0
    while True:
        data = bytearray(attacker.datagram(attacker.anywhere(), k * PERIOD_S))
        data[int(attacker.rng.integers(len(data)))] ^= int(attacker.rng.integers(1, 256))
        yield [bytes(data), attacker.rng.bytes(int(attacker.rng.integers(0, 2000)))]
        k += 1


ATTACKS: dict[str, Attack] = {
    "posture jumps": _every_period(_jumping),
    "random jumps each period": _random_jumps(PERIOD_S, 1.0),
    "random jumps each 0.2 s": _random_jumps(0.2, 1.0),
    "random jumps each second": _random_jumps(1.0, 1.0),
    "far beyond the limits": _random_jumps(0.5, 1e6),
    "base rolls 1.5 rad": _held(lambda a: a.standing(roll=1.5)),
    "base pitches -1.5 rad": _held(lambda a: a.standing(pitch=-1.5)),
    "base pitches 1.5 rad": _held(lambda a: a.standing(pitch=1.5)),
    "squat to 0.2 m": _held(lambda a: a.standing(height=0.2)),
    "hops to 5 m": _held(lambda a: a.standing(height=5.0)),
    "rolls and squats": _held(lambda a: a.standing(height=0.2, roll=-1.5, pitch=1.5)),
    **{f"shakes all at {hz} Hz": _shaking(hz) for hz in (0.3, 0.7, 1.0, 1.5, 2.0, 3.0, 7.0)},
    **{f"waves at {hz} Hz": _waving(hz) for hz in (0.3, 0.7, 1.0, 1.5, 3.0)},
    "times 1e-9 s apart": _no_time,
    "times that leap": _wild_time,
    "NaN and infinity": _nan,
    "replay": _replay,
    "streams that take over": _takeovers,
    "bursts and silence": _bursts,
    "flood": _flood,
    "random bytes": _random_bytes,
}


class AttackReport(NamedTuple):
    """What an attack came to.

    Attributes:
        fallen: Whether the robot fell, or leant so far that it is about to.
        tilt_rad: Largest angle between its base and that of the reference [rad].
        use: How much of their limits the commands used.
    """

    fallen: bool
    tilt_rad: float
    use: Use


def under_attack(robot: Robot, attack: Attack, seconds: float = 8.0, seed: int = 0) -> AttackReport:
    """Let a simulated robot balance under what an attack sends; on a virtual clock.

    Args:
        robot: The robot.
        attack: What comes.
        seconds: How long [s].
        seed: Of the attack's randomness.
    """
    simulation = Simulation(robot)
    simulation.reset()
    model, data = simulation.model, simulation.data
    n_steps = round(PERIOD_S / model.opt.timestep)
    commands, tilt, fallen = [], 0.0, False
    attacker = Attacker(robot, seed)
    with Receiver(robot, port=0) as receiver, Sender(robot, port=receiver.port) as wire:
        lower = LowerBody(robot, receiver, PERIOD_S)
        for k, come in zip(range(round(seconds / PERIOD_S)), attack(attacker), strict=False):
            for bytes_ in come:
                wire.send_bytes(bytes_)
            commands.append(lower.update(k * PERIOD_S))
            data.ctrl[:] = commands[-1]
            mujoco.mj_step(model, data, n_steps)
            wanted = lower.controller.reference.q
            alike = min(1.0, abs(float(data.qpos[3:7] @ wanted[3:7])))
            tilt = max(tilt, 2.0 * float(np.arccos(alike)))
            if not (data.qpos[2] > wanted[2] - DROP_M and tilt < _LEANS_RAD):
                fallen = True
                break
    attacker.sender.close()
    return AttackReport(fallen, tilt, lower.limiter.use(np.array(commands)))


def report_line(name: str, report: AttackReport | None = None) -> str:
    """Return a line of the table of attacks; its head without a report."""
    if report is None:
        return f"{name:26s} fell  lean [rad]  outside position, velocity, acceleration  of limits"
    position, velocity, acceleration = report.use.outside
    return (
        f"{name:26s} {'yes' if report.fallen else 'no':4s}  {report.tilt_rad:10.2f}  "
        f"{position:16d} {velocity:9d} {acceleration:13d}  "
        f"{report.use.fastest:.2f}, {report.use.strongest:.2f}"
    )
