"""Tasks: one reward a file; give your own `Task` to the environment, or one of these by name."""

from mplearn.errors import InvalidValueError

from .base import Choice as Choice
from .base import Scene as Scene
from .base import Task as Task
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

    Raises:
        InvalidValueError: There is no such task.
    """
    if isinstance(task, Task):
        return task
    if not isinstance(task, str) or task not in TASKS:
        raise InvalidValueError(f"task must be a Task or one of {tuple(TASKS)}, not {task!r}")
    return TASKS[task]()
