"""MCAP with ROS 2 messages: for Foxglove, Lichtblick, PlotJuggler and ROS 2 itself.

``/joint_trajectory`` is one `trajectory_msgs/JointTrajectory` with a point a frame (positions [rad]
and velocities [rad/s] by the joints' names, ``time_from_start``); ``/root_pose`` is a
`geometry_msgs/PoseStamped` a frame (m, quaternion x, y, z, w). Messages are CDR, as ROS 2 writes
them; neither ROS nor its packages are needed.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mplearn.errors import RecordingError
from mplearn.extras import require

from ..format import Format, Reading, in_order
from ..motion import RobotMotion
from ..robot_model import RobotModel

_TRAJECTORY, _POSE = "/joint_trajectory", "/root_pose"
_DAMAGES = (ValueError, IndexError, AttributeError, OSError, struct.error)
_SECOND = 1_000_000_000  # [ns]
_LINE = "=" * 80
_HEADER = f"""{_LINE}
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
{_LINE}
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
_TRAJECTORY_MESSAGE = f"""std_msgs/Header header
string[] joint_names
trajectory_msgs/JointTrajectoryPoint[] points
{_LINE}
MSG: trajectory_msgs/JointTrajectoryPoint
float64[] positions
float64[] velocities
float64[] accelerations
float64[] effort
builtin_interfaces/Duration time_from_start
{_LINE}
MSG: builtin_interfaces/Duration
int32 sec
uint32 nanosec
{_HEADER}"""
_POSE_MESSAGE = f"""std_msgs/Header header
geometry_msgs/Pose pose
{_LINE}
MSG: geometry_msgs/Pose
geometry_msgs/Point position
geometry_msgs/Quaternion orientation
{_LINE}
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
{_LINE}
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
{_HEADER}"""


class MCAP(Format):
    """See the module's docstring."""

    name = "mcap"
    about = "MCAP with ROS 2 messages: JointTrajectory and the base's PoseStamped (Foxglove, ROS)"
    suffix = ".mcap"

    def write(self, path: Path, motions: Sequence[RobotMotion], model: RobotModel) -> None:
        """Write one motion."""
        writer_of = require("mcap_ros2.writer", "export").Writer
        (motion,) = motions
        velocities = np.gradient(motion.joint_pos, 1.0 / motion.rate_hz, axis=0)
        stamps = [_stamp(t) for t in motion.times_s]
        with path.open("wb") as file, writer_of(file) as writer:
            trajectory = writer.register_msgdef(
                "trajectory_msgs/msg/JointTrajectory", _TRAJECTORY_MESSAGE
            )
            pose = writer.register_msgdef("geometry_msgs/msg/PoseStamped", _POSE_MESSAGE)
            header = {"stamp": _stamp(0.0), "frame_id": "world"}
            points = [
                {
                    "positions": angles,
                    "velocities": speeds,
                    "accelerations": [],
                    "effort": [],
                    "time_from_start": stamp,
                }
                for angles, speeds, stamp in zip(
                    motion.joint_pos.tolist(), velocities.tolist(), stamps, strict=True
                )
            ]
            message = {"header": header, "joint_names": list(motion.joint_names), "points": points}
            writer.write_message(_TRAJECTORY, trajectory, message, log_time=0)
            for k, (place, quat) in enumerate(
                zip(motion.root_pos.tolist(), motion.root_quat.tolist(), strict=True)
            ):
                message = {
                    "header": {"stamp": stamps[k], "frame_id": "world"},
                    "pose": {
                        "position": dict(zip("xyz", place, strict=True)),
                        "orientation": dict(zip("wxyz", quat, strict=True)),
                    },
                }
                writer.write_message(_POSE, pose, message, _nanoseconds(stamps[k]), sequence=k)
            writer.add_metadata("mplearn", {"name": motion.name, "robot": model.name})

    def read(self, path: Path, model: RobotModel) -> tuple[Reading, ...]:
        """Return the motion of a file; joints go by their names."""
        decoder = require("mcap_ros2.decoder", "export").DecoderFactory()
        make_reader = require("mcap.reader", "export").make_reader
        exceptions = require("mcap.exceptions", "export")
        try:
            with path.open("rb") as file:
                messages = make_reader(file, decoder_factories=[decoder])
                found = [
                    (channel.topic, decoded)
                    for _, channel, _, decoded in messages.iter_decoded_messages(
                        topics=[_TRAJECTORY, _POSE]
                    )
                ]
            trajectories = [message for topic, message in found if topic == _TRAJECTORY]
            poses = [message.pose for topic, message in found if topic == _POSE]
            if len(trajectories) != 1:
                raise ValueError(f"{len(trajectories)} messages on {_TRAJECTORY}, not one")
            points = trajectories[0].points
            order = in_order(path, "joint", trajectories[0].joint_names, model.joint_names)
            joints = np.array([point.positions for point in points])[:, order]
            velocities = np.array([point.velocities for point in points])[:, order]
            times = np.array([_seconds(point.time_from_start) for point in points])
            places = np.array([[p.position.x, p.position.y, p.position.z] for p in poses])
            quat = np.array([[getattr(p.orientation, axis) for axis in "wxyz"] for p in poses])
            if len(poses) != len(points):
                raise ValueError(f"{len(points)} points, but {len(poses)} poses of the base")
            step = float(np.median(np.diff(times)))
            if not step > 0:
                raise ValueError(f"its points are {step} s apart")
        except (exceptions.McapError, *_DAMAGES) as error:
            raise RecordingError(f"{path}: no MCAP file of a motion: {error!r}") from error
        reading = Reading(1.0 / step, places, quat, joints, joint_vel=velocities, times_s=times)
        return (reading.require(path, model),)


def _stamp(time_s: float) -> dict[str, int]:
    sec, nanosec = divmod(round(time_s * _SECOND), _SECOND)
    return {"sec": sec, "nanosec": nanosec}


def _nanoseconds(stamp: dict[str, int]) -> int:
    return stamp["sec"] * _SECOND + stamp["nanosec"]


def _seconds(duration: Any) -> float:
    return float(duration.sec) + float(duration.nanosec) / _SECOND
