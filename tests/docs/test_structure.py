"""The rooms import only downwards, and the page of the structure names all of them."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
MANY = {"mplearn.evaluation.experiments", "mplearn_agents.commands"}  # docs/structure.md says why


def drawn(*options: str) -> str:
    command = [sys.executable, "scripts/structure.py", *options]
    return subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout


@pytest.fixture(scope="module")
def rooms() -> list[str]:
    lines = [line.split() for line in drawn().splitlines() if line.startswith("  ")]
    return [words[0] for words in lines]


def test_the_page_names_each_room_that_there_is(rooms: list[str]) -> None:
    page = (ROOT / "docs" / "structure.md").read_text(encoding="utf-8")
    assert {"corpus", "errors", "environment", "commands"} <= set(rooms)
    missing = [room for room in rooms if f"`{room}/" not in page and f"`{room}.py`" not in page]
    assert not missing


def test_the_drawing_has_each_room_beneath_all_that_import_it(rooms: list[str]) -> None:
    picture = drawn("--svg", "-")
    assert picture.count("<rect") == len(rooms)
    lines = [part.split("/>")[0] for part in picture.split("<line ")[1:]]
    assert len(lines) > len(rooms)
    for line in lines:
        _, y1, _, y2 = (float(value) for value in line.split('"')[1::2])
        assert y1 < y2, line


def test_rooms_hold_few_files() -> None:
    for package in ("mplearn", "envs/mplearn_envs", "agents/mplearn_agents"):
        for init in (ROOT / package).rglob("__init__.py"):
            room = ".".join(init.parent.relative_to(ROOT).parts[0 if package == "mplearn" else 1 :])
            assert room in MANY or len(list(init.parent.glob("*.py"))) <= 18, room
