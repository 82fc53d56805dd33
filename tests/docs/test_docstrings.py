"""The examples in docstrings run; a module joins by having one."""

import doctest
import importlib
import importlib.util
import inspect
from pathlib import Path

import pytest

import mplearn
import mplearn_agents
import mplearn_envs

ROOT = Path(__file__).parents[2]
MODULES = [
    ".".join(path.relative_to(root.parent).with_suffix("").parts).removesuffix(".__init__")
    for root in (Path(package.__path__[0]) for package in (mplearn, mplearn_envs, mplearn_agents))
    for path in sorted(root.rglob("*.py"))
    if ">>> " in path.read_text(encoding="utf-8")
]


REGISTRIES = {  # what examples register is gone afterwards
    "mplearn.mocap.registry": "_registered",
    "mplearn.sources.registry": "_registered",
    "mplearn.store.commands": "_KINDS",
    "mplearn.tree.distance": "_KINDS",
}


@pytest.mark.parametrize("name", MODULES)
def test_examples_run(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for room, registry in REGISTRIES.items():
        module = importlib.import_module(room)
        monkeypatch.setattr(module, registry, getattr(module, registry).copy())
    module = importlib.import_module(name)
    examples = [each for each in doctest.DocTestFinder().find(module) if each.examples]
    assert examples
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS)
    for each in examples:  # each in a folder of its own: files have the same names
        folder = tmp_path / each.name
        folder.mkdir()
        monkeypatch.chdir(folder)
        runner.run(each)
    assert not runner.summarize().failed


#: Classes and functions of the reference that have no example, for it would take minutes, or
#: another machine.
WITHOUT = {
    "mplearn.corpus": ["RayTasks"],
    "mplearn.errors": ["CorpusError"],
    "mplearn.evaluation.experiments": [
        *("judge_paper_session", "peers_table", "foretell_paper_sessions"),
        *("learn_paper_sessions", "demonstrated_shards"),
    ],
    "mplearn_agents.rl": ["TrainedPolicy"],
    "mplearn_envs.experiments": ["learned_table", "push_table", "soak_table", "survival_table"],
}


def public() -> list[tuple[str, str]]:
    """Return all classes and functions that have a page of the reference, or a part of one."""
    spec = importlib.util.spec_from_file_location("hooks", ROOT / "docs" / "hooks.py")
    assert spec is not None and spec.loader is not None
    hooks = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(hooks)
    names = {(room, name) for room in hooks.MODULES for name in own(room)}
    for package, folder in hooks.PACKAGES.items():
        for init in (ROOT / folder).glob("*/**/__init__.py"):
            room = ".".join((package, *init.parent.relative_to(ROOT / folder).parts))
            names |= {(room, name) for name in hooks.public_names(init)}
    return sorted((room, name) for room, name in names if is_code(room, name))


def own(room: str) -> list[str]:
    """Return the names that a module defines itself."""
    values = vars(importlib.import_module(room)).items()
    return [
        name
        for name, value in values
        if not name.startswith("_") and getattr(value, "__module__", None) == room
    ]


def is_code(room: str, name: str) -> bool:
    """Say whether a name is of a class or a function, not of a constant or a type's other name."""
    value = getattr(importlib.import_module(room), name)
    return inspect.isclass(value) or inspect.isroutine(value) or hasattr(value, "py_func")


@pytest.mark.parametrize(("room", "name"), public())
def test_what_is_public_has_an_example(room: str, name: str) -> None:
    document = getattr(importlib.import_module(room), name).__doc__ or ""
    assert (">>> " in document) != (name in WITHOUT.get(room, []))


def test_the_ground_floor_has_examples() -> None:
    assert "mplearn.maths.rotations" in MODULES
