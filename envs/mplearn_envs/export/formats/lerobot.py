"""LeRobot data sets, version 3.0: a folder of parquet files and what describes them.

Each motion is an episode. ``observation.state`` is where the base is, how it is turned and the
angles of the hinges, ``action`` the hinges' angles of the next frame, each component with its name
(``root.x`` [m], ``root.qw``, ``left_knee_joint.pos`` [rad]); a frame's task is the name of the
primitive that is performed then. Without pictures, so without videos.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from mplearn.errors import RecordingError
from mplearn.extras import require
from mplearn.recording import FloatArray

from ..format import Format, Reading, in_order
from ..motion import RobotMotion
from ..robot_model import RobotModel

_VERSION = "v3.0"
_INFO, _STATS, _TASKS = "meta/info.json", "meta/stats.json", "meta/tasks.parquet"
_CHUNK = "chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
_DATA, _EPISODES = f"data/{_CHUNK}", f"meta/episodes/{_CHUNK}"
_ROOT = ("root.x", "root.y", "root.z", "root.qw", "root.qx", "root.qy", "root.qz")
_QUANTILES = {"q01": 0.01, "q10": 0.1, "q50": 0.5, "q90": 0.9, "q99": 0.99}
_COUNTERS = ("frame_index", "episode_index", "index", "task_index")
_STATE, _ACTION = "observation.state", "action"


class LeRobot(Format):
    """See the module's docstring."""

    name = "lerobot"
    about = "folder: a LeRobot data set v3.0, an episode a motion, a task a primitive"
    suffix = ""
    many = True

    def write(self, path: Path, motions: Sequence[RobotMotion], model: RobotModel) -> None:
        """Write motions, an episode each."""
        arrow, parquet = require("pyarrow", "export"), require("pyarrow.parquet", "export")
        tasks = list(dict.fromkeys(task for motion in motions for task in _tasks(motion)))
        number = {task: k for k, task in enumerate(tasks)}
        names = {
            _STATE: [*_ROOT, *(f"{joint}.pos" for joint in model.joint_names)],
            _ACTION: [f"{joint}.pos" for joint in model.joint_names],
        }
        episodes = [_episode(motion, k, number) for k, motion in enumerate(motions)]
        starts = np.cumsum([0, *(len(motion) for motion in motions)])
        for episode, (start, end) in zip(episodes, pairwise(starts), strict=True):
            episode["index"] = np.arange(start, end)[:, None]
        whole = {key: np.concatenate([each[key] for each in episodes]) for key in episodes[0]}
        rows = [
            {
                "episode_index": k,
                "tasks": list(dict.fromkeys(_tasks(motion))),
                "length": len(motion),
                "data/chunk_index": 0,
                "data/file_index": 0,
                "dataset_from_index": int(starts[k]),
                "dataset_to_index": int(starts[k + 1]),
                "meta/episodes/chunk_index": 0,
                "meta/episodes/file_index": 0,
                **{
                    f"stats/{key}/{what}": value
                    for key, values in episodes[k].items()
                    for what, value in _statistics(values).items()
                },
            }
            for k, motion in enumerate(motions)
        ]
        first = {"chunk_index": 0, "file_index": 0}
        for place in (_DATA.format(**first), _EPISODES.format(**first)):
            (path / place).parent.mkdir(parents=True, exist_ok=True)
        parquet.write_table(_table(arrow, whole), path / _DATA.format(**first))
        parquet.write_table(arrow.Table.from_pylist(rows), path / _EPISODES.format(**first))
        parquet.write_table(_task_table(arrow, tasks), path / _TASKS)
        rate_hz = motions[0].rate_hz
        info = {
            "codebase_version": _VERSION,
            "robot_type": model.name,
            "total_episodes": len(motions),
            "total_frames": int(starts[-1]),
            "total_tasks": len(tasks),
            "chunks_size": 1000,
            "data_files_size_in_mb": 100,
            "video_files_size_in_mb": 200,
            "fps": int(rate_hz) if float(rate_hz).is_integer() else rate_hz,
            "splits": {"train": f"0:{len(motions)}"},
            "data_path": _DATA,
            "video_path": None,
            "features": {
                key: {
                    "dtype": str(values.dtype),
                    "shape": [values.shape[1]],
                    "names": names.get(key),
                }
                for key, values in whole.items()
            },
        }
        statistics = {key: _statistics(values) for key, values in whole.items()}
        (path / _INFO).write_text(json.dumps(info, indent=4), encoding="utf-8")
        (path / _STATS).write_text(json.dumps(statistics, indent=4), encoding="utf-8")

    def read(self, path: Path, model: RobotModel) -> tuple[Reading, ...]:
        """Return the episodes of a data set; components go by their names."""
        parquet = require("pyarrow.parquet", "export")
        try:
            info = json.loads((path / _INFO).read_text("utf-8"))
            found = info["features"][_STATE]["names"]
            wanted = [*_ROOT, *(f"{joint}.pos" for joint in model.joint_names)]
            order = in_order(path, "component of the state", found, wanted)
            tables = [parquet.read_table(file) for file in sorted(path.glob("data/*/*.parquet"))]
            columns = {
                key: np.concatenate(
                    [np.array(table[key].to_pylist(), dtype=np.float64) for table in tables]
                )
                for key in (_STATE, "timestamp", "episode_index")
            }
            rate_hz = float(info["fps"])
            episodes = np.unique(columns["episode_index"])
            if len(episodes) != info["total_episodes"]:
                raise ValueError(f"{len(episodes)} episodes, info says {info['total_episodes']}")
            data = require("pyarrow", "export").concat_tables(tables)
            _require_features(info, data)
            _require_tasks(info, parquet.read_table(path / _TASKS), data)
            rows = [parquet.read_table(file) for file in sorted(path.glob("meta/episodes/*/*"))]
            _require_episodes(rows, columns["episode_index"])
            _require_statistics(json.loads((path / _STATS).read_text("utf-8")), data)
        except (OSError, ValueError, KeyError, TypeError, AttributeError, IndexError) as error:
            raise RecordingError(f"{path}: no LeRobot data set: {error!r}") from error
        out = []
        for episode in episodes:
            own = columns["episode_index"] == episode
            state, times = columns[_STATE][own][:, order], columns["timestamp"][own].reshape(-1)
            reading = Reading(rate_hz, state[:, :3], state[:, 3:7], state[:, 7:], times_s=times)
            out.append(reading.require(path, model))
        return tuple(out)

    def accepts(self, path: Path) -> bool:
        """Whether it is a folder with a data set's description."""
        return (path / _INFO).is_file()


def _require_features(info: dict[str, Any], data: Any) -> None:
    """Check that a data set is of this version, and its columns are those that are described."""
    version = info["codebase_version"]
    if not str(version).startswith("v3."):
        raise ValueError(f"{_INFO}: version {version!r}, not {_VERSION!r}")
    if info["total_frames"] != len(data):
        raise ValueError(f"{_INFO}: {info['total_frames']} frames, {len(data)} are there")
    stored = {key: each for key, each in info["features"].items() if each["dtype"] != "video"}
    if stored.keys() != set(data.column_names):
        raise ValueError(f"{_INFO}: columns {sorted(stored)}, not {sorted(data.column_names)}")
    for key, each in stored.items():
        width = np.array(data[key][:1].to_pylist()).size
        if each["dtype"] not in ("image", "string") and int(np.prod(each["shape"])) != width:
            raise ValueError(f"{_INFO}: {key} has shape {each['shape']}, and {width} components")


def _require_tasks(info: dict[str, Any], tasks: Any, data: Any) -> None:
    """Check that each frame's task is one of those that are named."""
    numbers = tasks["task_index"].to_pylist()
    used = set(data["task_index"].to_pylist())
    if info["total_tasks"] != len(numbers):
        raise ValueError(f"{_INFO}: {info['total_tasks']} tasks, {_TASKS} has {len(numbers)}")
    if sorted(numbers) != list(range(len(numbers))) or not used <= set(numbers):
        raise ValueError(f"{_TASKS}: tasks {sorted(numbers)}, used are {sorted(used)}")
    names = next(tasks[name] for name in tasks.column_names if name != "task_index").to_pylist()
    if not all(isinstance(name, str) for name in names):
        raise ValueError(f"{_TASKS}: a task has no name")


def _require_episodes(rows: Sequence[Any], episode_of: FloatArray) -> None:
    """Check that episodes lie where they are said to, one after the other."""
    numbers, counts = np.unique(episode_of, return_counts=True)
    ends = np.cumsum(counts)
    wanted = [numbers, counts, ends - counts, ends]
    keys = ("episode_index", "length", "dataset_from_index", "dataset_to_index")
    for key, values in zip(keys, wanted, strict=True):
        said = [value for table in rows for value in table[key].to_pylist()]
        if said != values.tolist():
            raise ValueError(f"meta/episodes: {key} {said}, not {values.astype(int).tolist()}")


def _require_statistics(statistics: dict[str, Any], data: Any) -> None:
    """Check the statistics that networks scale by."""
    for key in set(data.column_names) & statistics.keys():
        values = np.array(data[key].to_pylist(), dtype=np.float64).reshape(len(data), -1)
        least, most = values.min(axis=0), values.max(axis=0)
        close = 1e-3 * np.maximum(most - least, 1e-3)
        found = {"min": least, "max": most, "mean": values.mean(axis=0), "std": values.std(axis=0)}
        for what, right in found.items():
            said = np.asarray(statistics[key][what], dtype=np.float64).reshape(-1)
            if said.shape != right.shape or not (np.abs(said - right) <= close).all():
                raise ValueError(f"{_STATS}: {what} of {key} is {said.tolist()}")
    lacking = {_STATE, _ACTION} - statistics.keys()
    if lacking:
        raise ValueError(f"{_STATS}: nothing about {sorted(lacking)}")


def _tasks(motion: RobotMotion) -> list[str]:
    """Return the task of each frame: the primitive's name, else the motion's."""
    out = [motion.name] * len(motion)
    for span in motion.spans:
        first, last = (round(t * motion.rate_hz) for t in (span.start_s, span.end_s))
        out[first : last + 1] = [span.name] * len(out[first : last + 1])
    return out


def _episode(motion: RobotMotion, k: int, number: dict[str, int]) -> dict[str, Any]:
    """Return the columns of an episode, each of shape (T, width)."""
    n_frames = len(motion)
    state = np.hstack((motion.root_pos, motion.root_quat, motion.joint_pos))
    following = np.vstack((motion.joint_pos[1:], motion.joint_pos[-1:]))
    return {
        _STATE: state.astype(np.float32),
        _ACTION: following.astype(np.float32),
        "timestamp": motion.times_s.astype(np.float32)[:, None],
        "frame_index": np.arange(n_frames)[:, None],
        "episode_index": np.full((n_frames, 1), k),
        "index": np.zeros((n_frames, 1), dtype=np.int64),  # when all episodes are known
        "task_index": np.array([number[task] for task in _tasks(motion)])[:, None],
    }


def _statistics(values: FloatArray) -> dict[str, list[float]]:
    """Return statistics of a column, shape (T, width), as LeRobot has them."""
    exact = values.astype(np.float64)
    found = {
        "min": exact.min(axis=0),
        "max": exact.max(axis=0),
        "mean": exact.mean(axis=0),
        "std": exact.std(axis=0),
        **{name: np.quantile(exact, share, axis=0) for name, share in _QUANTILES.items()},
    }
    return {name: value.tolist() for name, value in found.items()} | {"count": [len(values)]}


def _table(arrow: Any, columns: dict[str, Any]) -> Any:
    """Return columns as a table: lists of a fixed length where they have components."""
    out = {}
    for key, values in columns.items():
        flat = arrow.array(values.reshape(-1))
        plain = key == "timestamp" or key in _COUNTERS
        out[key] = flat if plain else arrow.FixedSizeListArray.from_arrays(flat, values.shape[1])
    return arrow.table(out)


def _task_table(arrow: Any, tasks: list[str]) -> Any:
    """Return the tasks as pandas would write them, by name: LeRobot reads this with pandas."""
    index = "__index_level_0__"
    kinds = {"task_index": ("int64", "int64"), index: ("unicode", "object")}
    pandas = {
        "index_columns": [index],
        "column_indexes": [],
        "columns": [
            {
                "name": None if name == index else name,
                "field_name": name,
                "pandas_type": kind,
                "numpy_type": numpy_type,
                "metadata": None,
            }
            for name, (kind, numpy_type) in kinds.items()
        ],
        "pandas_version": "2.2.0",
    }
    table = arrow.table({"task_index": arrow.array(range(len(tasks))), index: arrow.array(tasks)})
    return table.replace_schema_metadata({"pandas": json.dumps(pandas)})
