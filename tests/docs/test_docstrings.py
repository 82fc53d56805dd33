"""The examples in docstrings run; a module joins by having one."""

import doctest
import importlib
from pathlib import Path

import pytest

import mplearn
import mplearn_agents
import mplearn_envs

MODULES = [
    ".".join(path.relative_to(root.parent).with_suffix("").parts).removesuffix(".__init__")
    for root in (Path(package.__path__[0]) for package in (mplearn, mplearn_envs, mplearn_agents))
    for path in sorted(root.rglob("*.py"))
    if ">>> " in path.read_text(encoding="utf-8")
]


@pytest.mark.parametrize("name", MODULES)
def test_examples_run(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    module = importlib.import_module(name)
    failed, tried = doctest.testmod(module, optionflags=doctest.ELLIPSIS)
    assert tried
    assert not failed


def test_the_ground_floor_has_examples() -> None:
    assert "mplearn.maths.rotations" in MODULES
