"""On-line inverse kinematics, gaps included, against the sampling interval and against mink."""

import time

import mink
import mujoco
import numpy as np

from mplearn.body import Body, InverseKinematics, human_body, marker_set, robot_body
from mplearn.demonstrator import demonstrate, markov_script
from mplearn.mocap import GapTracker
from mplearn.recording import Recording

FRAMES = 3000
MINK_STEPS = 4  # of a frame: as many as ours needs at most


def rows() -> list[tuple[str, str, str, str]]:
    recording = demonstrate(markov_script(30, np.random.default_rng(3)), 3).recording
    interval_s = 1.0 / recording.rate_hz
    table = []
    for body in (human_body(), robot_body()):
        filling, solving, peer = _times(body, recording)
        both = filling + solving
        name = f"a frame, {body.name}, {len(body.driven)} joints, 34 markers"
        interval = f"{_us(interval_s)}, sampling interval"
        median, late = float(np.median(both)), float(np.percentile(both, 99))
        alone, mink_s = float(np.median(solving)), float(np.median(peer))
        table += [
            (name, _us(median), interval, f"{interval_s / median:.0f} x"),
            (f"{name}, p99", _us(late), interval, f"{interval_s / late:.0f} x"),
            (
                f"inverse kinematics alone, {body.name}",
                _us(alone),
                f"{_us(mink_s)}, mink with daqp on the human, {MINK_STEPS} steps",
                f"{mink_s / alone:.0f} x",
            ),
        ]
    return table


def _times(body: Body, recording: Recording) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time gap tracking, inverse kinematics and, every 30th frame, mink, frame by frame [s]."""
    markers = recording.markers[:FRAMES]
    ik = InverseKinematics(body, recording.marker_names, rate_hz=recording.rate_hz)
    ik.calibrate(markers[:60])
    gaps, other = GapTracker(markers.shape[1], recording.rate_hz), Mink()
    filling, solving, peer = [], [], []
    for k, frame in enumerate(markers):
        begin = time.process_time()
        filled = gaps.update(frame)
        between = time.process_time()
        ik.update(filled)
        end = time.process_time()
        filling.append(between - begin)
        solving.append(end - between)
        if k % 30 == 0 and np.isfinite(filled).all():
            other.update(filled)
            peer.append(time.process_time() - end)
    return np.array(filling), np.array(solving), np.array(peer)


class Mink:
    """mink's marker following on the same human: a frame task on the site of each marker."""

    def __init__(self) -> None:
        body = human_body()
        spec = mujoco.MjSpec.from_string(body.xml)
        chosen = marker_set("paper34")
        for name, carrier, offset in zip(chosen.names, chosen.bodies, chosen.offsets, strict=True):
            spec.body(carrier).add_site(name=f"marker_{name}", pos=offset)
        self.configuration = mink.Configuration(spec.compile())
        self.tasks = [
            mink.FrameTask(f"marker_{name}", "site", position_cost=1.0, orientation_cost=0.0)
            for name in chosen.names
        ]
        self.limits = [mink.ConfigurationLimit(self.configuration.model)]

    def update(self, frame: np.ndarray) -> None:
        for task, place in zip(self.tasks, frame, strict=True):
            task.set_target(mink.SE3.from_translation(place))
        for _ in range(MINK_STEPS):
            velocity = mink.solve_ik(
                self.configuration, self.tasks, 0.01, "daqp", damping=1e-3, limits=self.limits
            )
            self.configuration.integrate_inplace(velocity, 0.01)


def _us(seconds: float) -> str:
    return f"{1e6 * seconds:.0f} us"
