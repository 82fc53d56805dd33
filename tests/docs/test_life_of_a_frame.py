"""The page on a frame's life names what is there."""

import importlib
import re
from pathlib import Path

import pytest

PAGE = (Path(__file__).parents[2] / "docs" / "life-of-a-frame.md").read_text(encoding="utf-8")
NAMES = sorted(set(re.findall(r"`(mplearn(?:_envs|_agents)?(?:\.\w+)+)`", PAGE)))


@pytest.mark.parametrize("name", NAMES)
def test_what_the_page_names_is_there(name: str) -> None:
    parts = name.split(".")
    for at in range(len(parts), 0, -1):
        try:
            found = importlib.import_module(".".join(parts[:at]))
        except ModuleNotFoundError:
            continue
        break
    for part in parts[at:]:
        found = getattr(found, part)


def test_the_page_follows_a_frame() -> None:
    assert len(NAMES) > 20
