"""What the README shows, runs."""

import re
from pathlib import Path

import pytest

README = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```python\n(.*?)```", README, flags=re.DOTALL)


def test_the_ten_lines_run(capsys: pytest.CaptureFixture[str]) -> None:
    script = BLOCKS[0].rstrip()
    lines = [line for line in script.splitlines() if line]
    assert len(lines) == 10
    exec(compile(script, "README.md", "exec"), {})
    performed = capsys.readouterr().out.splitlines()
    assert len(performed) == 20
    assert not any("fell" in line for line in performed)
    assert len({line.split()[0] for line in performed}) > 3


def test_the_commands_exist() -> None:
    from mplearn_agents.cli import command_modules

    shown = set(re.findall(r"^mplearn (\w+)", README, flags=re.MULTILINE))
    assert shown <= set(command_modules())
    assert len(shown) >= 5


def test_the_targets_exist() -> None:
    makefile = (Path(__file__).parents[2] / "Makefile").read_text(encoding="utf-8")
    for target in re.findall(r"^make (\w+)", README, flags=re.MULTILINE):
        assert re.search(rf"^{target}:", makefile, flags=re.MULTILINE), target
