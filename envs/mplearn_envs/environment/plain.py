"""Arguments of environments as JSON holds them, and back: so that a spec makes the same again.

An object becomes a mapping with its ``type``, "module:Class", beside its fields: dataclasses do
(tasks, robots, options, configurations), libraries and arrays with their bytes in base 64. What can
be none of these, like a learner that goes on, stays as it is.
"""

from __future__ import annotations

import base64
import copy
import importlib
import tempfile
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium.envs.registration import EnvSpec

from mplearn.errors import InvalidValueError, MPLearnError
from mplearn.library import PrimitiveLibrary
from mplearn_envs.tasks import Task

TYPE = "type"
_LIBRARY, _ARRAY, _ARGUMENTS = "mplearn:library", "numpy:array", "arguments"


class PlainSpec:
    """What has a spec whose arguments are as JSON holds them, whatever it was made with."""

    _spec: EnvSpec | None = None

    @property
    def spec(self) -> EnvSpec | None:
        """How to make the environment again."""
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        if spec is not None:
            spec = copy.copy(spec)
            spec.kwargs = to_plain(spec.kwargs)
            library, task, robot = (spec.kwargs.get(key) for key in ("library", "task", "robot"))
            if isinstance(library, str):
                spec.kwargs["library"] = str(Path(library).absolute())
            if isinstance(task, str) and ".py:" in task:
                spec.kwargs["task"] = str(Path(task).absolute())
            if isinstance(robot, str) and robot.lower().endswith(".toml"):
                spec.kwargs["robot"] = str(Path(robot).absolute())
            spec.max_episode_steps = spec.kwargs.get("max_episode_steps", spec.max_episode_steps)
        self._spec = spec


def to_plain(value: Any) -> Any:
    """Return an argument as JSON holds it."""
    if isinstance(value, (np.bool_, np.integer, np.floating)):
        return value.item()
    if isinstance(value, Path):
        return str(value.absolute())
    if isinstance(value, Mapping):
        return {key: to_plain(each) for key, each in value.items()}
    if isinstance(value, (tuple, list)):
        return [to_plain(each) for each in value]
    if isinstance(value, np.ndarray) and value.dtype.kind in "biuf":
        return {
            TYPE: _ARRAY,
            "dtype": value.dtype.str,
            "shape": list(value.shape),
            "data": base64.b64encode(value.tobytes()).decode("ascii"),
        }
    if isinstance(value, PrimitiveLibrary):
        with tempfile.TemporaryDirectory() as folder:
            data = value.save(Path(folder) / "library.mplearn").read_bytes()
        return {TYPE: _LIBRARY, "data": base64.b64encode(data).decode("ascii")}
    return _object_to_plain(value)


def from_plain(value: Any) -> Any:
    """Return the argument that `to_plain` made plain; what was given otherwise is left as it is.

    Raises:
        InvalidValueError: It names a type that there is not, or that takes other arguments.
    """
    if isinstance(value, list):
        return tuple(from_plain(each) for each in value)
    if not isinstance(value, Mapping):
        return value
    kind = value.get(TYPE)
    if not (isinstance(kind, str) and ":" in kind):
        return {key: from_plain(each) for key, each in value.items()}
    try:
        if kind == _ARRAY:
            data = np.frombuffer(base64.b64decode(value["data"]), value["dtype"])
            return data.reshape(value["shape"]).copy()
        if kind == _LIBRARY:
            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder) / "library.mplearn"
                path.write_bytes(base64.b64decode(value["data"]))
                return PrimitiveLibrary.load(path)
        made: Any = importlib.import_module(kind.partition(":")[0])
        for name in kind.partition(":")[2].split("."):
            made = getattr(made, name)
        return made(**from_plain(value[_ARGUMENTS]))
    except MPLearnError:
        raise
    except (ImportError, AttributeError, KeyError, TypeError, ValueError) as error:
        raise InvalidValueError(f"an argument of type {kind!r} cannot be made: {error}") from error


def _object_to_plain(value: Any) -> Any:
    """Return a dataclass, or a task without arguments, as a mapping; anything else as it is."""
    kind = type(value)
    if "<locals>" in kind.__qualname__ or kind.__module__ == "__main__":
        return value
    if is_dataclass(value) and not isinstance(value, type):
        arguments = {
            each.name: to_plain(getattr(value, each.name)) for each in fields(value) if each.init
        }
    elif isinstance(value, Task) and kind.__init__ is object.__init__:
        arguments = {}
    else:
        return value
    return {TYPE: f"{kind.__module__}:{kind.__qualname__}", _ARGUMENTS: arguments}
