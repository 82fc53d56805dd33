"""What holds arrays is compared as one thing: of two arrays NumPy says no one yes or no."""

import ast
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import mplearn
import mplearn_agents
import mplearn_envs
from mplearn import Recording
from mplearn.generation import Trajectory
from mplearn.hmm import LeftRightHMM

SOURCES = [
    path
    for package in (mplearn, mplearn_envs, mplearn_agents)
    for path in sorted(Path(package.__path__[0]).rglob("*.py"))
]


def compared_by_value(path: Path) -> list[str]:
    """Return the dataclasses of a file that hold arrays and compare them with ``==`` alone."""
    found = []
    for each in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if not isinstance(each, ast.ClassDef):
            continue
        marks = " ".join(map(ast.unparse, each.decorator_list))
        fields = [ast.unparse(line.annotation) for line in each.body if hasattr(line, "annotation")]
        arrays = any("Array" in kind and "Callable" not in kind for kind in fields)
        own = any(getattr(line, "name", "") == "__eq__" for line in each.body)
        if "dataclass" in marks and "eq=False" not in marks and arrays and not own:
            found.append(each.name)
    return found


def test_no_dataclass_compares_arrays() -> None:
    assert len(SOURCES) > 300
    assert {path.name: names for path in SOURCES if (names := compared_by_value(path))} == {}


@pytest.mark.parametrize(
    "one",
    [
        Recording(np.zeros((3, 1)), 50.0, ("elbow",)),
        Trajectory(np.zeros((3, 1)), 50.0, ("elbow",), np.zeros(3, int)),
        LeftRightHMM(np.zeros((2, 1)), np.ones((2, 1)), np.log([0.5, 1.0])),
    ],
    ids=lambda one: type(one).__name__,
)
def test_recordings_trajectories_and_models_can_be_compared_and_kept_in_sets(one: object) -> None:
    other = replace(one)  # type: ignore[type-var]
    assert one == one and one != other
    assert len({one, other, one}) == 2
