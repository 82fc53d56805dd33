"""Tasks: one reward a file; give your own `Task` to the environment, or one of these by name."""

import importlib
import importlib.util
import sys
from pathlib import Path

from mplearn.errors import InvalidValueError

from .base import Choice as Choice
from .base import Scene as Scene
from .base import Task as Task
from .base import Ways as Ways
from .follow import FollowTask as FollowTask
from .free import FreeTask as FreeTask
from .goal import GoalTask as GoalTask
from .recite import ReciteTask as ReciteTask

TASKS: dict[str, type[Task]] = {
    "free": FreeTask,
    "goal": GoalTask,
    "follow": FollowTask,
    "recite": ReciteTask,
}


def make_task(task: str | Task) -> Task:
    """Return a task by its name, or the task itself.

    Args:
        task: A task; or the name of one of `TASKS`; or where a class of one's own is, as
            "module:Class" or "file.py:Class".

    Raises:
        InvalidValueError: There is no such task.
    """
    if isinstance(task, Task):
        return task
    if isinstance(task, str) and ":" in task:
        return _own(task)
    if not isinstance(task, str) or task not in TASKS:
        raise InvalidValueError(
            f"task must be a Task or one of {tuple(TASKS)}, or 'module:Class' or 'file.py:Class' "
            f"of your own, not {task!r:.80}"
        )
    return TASKS[task]()


def _own(place: str) -> Task:
    """Return a task of somebody's own."""
    where, _, name = place.rpartition(":")
    try:
        if where.endswith(".py"):
            name_of_file = f"mplearn_task_{Path(where).stem}"
            spec = importlib.util.spec_from_file_location(name_of_file, where)
            assert spec is not None and spec.loader is not None  # it ends with .py
            module = sys.modules[name_of_file] = importlib.util.module_from_spec(spec)
            spec.loader.exec_module(module)
        else:
            module = importlib.import_module(where)
        made = getattr(module, name)()
    except Exception as error:  # whatever happens in another's code
        raise InvalidValueError(f"task {place!r} cannot be made: {error!r:.200}") from error
    if not isinstance(made, Task):
        raise InvalidValueError(f"task {place!r} is a {type(made).__name__}, not a Task")
    return made
