"""What the pages of the documentation name is there: commands, options, targets, modules, names."""

import argparse
import ast
import builtins
import importlib
import importlib.util
import re
import shlex
import tomllib
from functools import cache
from pathlib import Path

import pytest

from mplearn.errors import InvalidValueError
from mplearn_agents.cli import build_parser, command_modules

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
TEXTS = {page.relative_to(ROOT).as_posix(): page.read_text(encoding="utf-8") for page in PAGES}
FENCED = re.compile(r"```(\w*)\n(.*?)```", re.DOTALL)
PROGRAMS = re.compile(r"(mplearn|python -m|make) \S")
ENTRY_POINTS = {
    "readers",
    "segmenters",
    "sources",
    "distances",
    "formats",
}  # groups, which no module is


def commands() -> list[tuple[str, str]]:
    """Return all commands in blocks of pages, with the page's name; options of all are given."""
    return sorted(
        {
            (page, command.strip())
            for page, text in TEXTS.items()
            for language, block in FENCED.findall(text)
            if language in ("", "sh", "bash")
            for line in block.replace("\\\n", " ").splitlines()
            for command in re.split(r" (?:\||;|&&|>) ", line.split(" #")[0])
            if PROGRAMS.match(command)
        }
    )


def mentioned() -> list[tuple[str, str]]:
    """Return all commands within sentences, of which not all that they need is given."""
    return sorted(
        {
            (page, " ".join(command.split()))
            for page, text in TEXTS.items()
            for command in re.findall(r"`((?:mplearn|python -m) [^`]+)`", FENCED.sub("", text))
        }
    )


@cache
def parser() -> argparse.ArgumentParser:
    return build_parser()


def options_of(found: argparse.ArgumentParser, words: list[str]) -> set[str]:
    """Return the options of a command, those of its own sub-commands included."""
    options = set(found._option_string_actions)
    for action in found._actions:
        if isinstance(action, argparse._SubParsersAction):
            for word in words:
                if word in action.choices:
                    options |= options_of(action.choices[word], words)
                    break
    return options


@pytest.mark.parametrize(("page", "command"), commands())
def test_commands_can_be_given(page: str, command: str) -> None:
    match shlex.split(command):
        case ["mplearn", *rest]:
            try:
                parser().parse_args(rest)
            except SystemExit as end:
                assert not end.code, f"mplearn refuses what {page} shows: {command}"
            except InvalidValueError as error:
                pytest.fail(f"mplearn refuses what {page} shows: {command}: {error}")
        case ["python", "-m", module, *_]:
            assert importlib.util.find_spec(module), f"{page}: no module {module}"
        case ["make", *targets]:
            makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
            for target in targets:
                assert re.search(rf"^{target}\b.*:", makefile, re.MULTILINE), f"{page}: {target}"


@pytest.mark.parametrize(("page", "command"), mentioned())
def test_mentioned_commands_have_their_options(page: str, command: str) -> None:
    words = shlex.split(command)
    if words[0] == "python":
        assert importlib.util.find_spec(words[2]), f"{page}: no module {words[2]}"
        return
    assert words[1] in {*command_modules(), "..."} or words[1].startswith(("-", "COMMAND"))
    unknown = {word for word in words if word.startswith("--")} - options_of(parser(), words[1:])
    assert not unknown, f"{page}: {command}"


def test_pages_show_many_commands() -> None:
    assert len(commands()) > 40
    assert len(mentioned()) > 40


@pytest.mark.parametrize("name", sorted(command_modules()))
def test_the_example_of_a_command_can_be_given(name: str) -> None:
    for line in command_modules()[name].EXAMPLE.splitlines():
        words = shlex.split(line.split(" > ")[0], comments=True)
        if words[:1] == ["mplearn"]:
            parser().parse_args(words[1:])


def test_the_readme_names_all_extras_and_no_page_names_another() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = set(project["optional-dependencies"])
    named = {page: set(re.findall(r"mplearn\[(\w+)\]", text)) for page, text in TEXTS.items()}
    assert named["README.md"] == extras
    assert set().union(*named.values()) == extras


def blocks() -> list[tuple[str, str]]:
    return [
        (page, block)
        for page, text in TEXTS.items()
        for language, block in FENCED.findall(text)
        if language == "python" and "--8<--" not in block
    ]


@pytest.mark.parametrize(("page", "block"), blocks())
def test_what_python_blocks_import_is_there(page: str, block: str) -> None:
    for node in ast.walk(ast.parse(block)):
        if isinstance(node, ast.ImportFrom):
            module = importlib.import_module(str(node.module))
            for each in node.names:
                assert hasattr(module, each.name), f"{page}: {node.module} has no {each.name}"
        elif isinstance(node, ast.Import):
            for each in node.names:
                importlib.import_module(each.name)


#: What a reader of a page has, or is told of in its text.
OF_THE_READER = {
    "README.md": {"learner", "segment"},
    "docs/how-to/robot.md": {"attention", "segments"},
}


@pytest.mark.parametrize("page", sorted({page for page, _ in blocks()} - {"docs/structure.md"}))
def test_python_blocks_of_a_page_say_where_each_name_is_from(page: str) -> None:
    known = {*dir(builtins), *OF_THE_READER.get(page, ())}
    for block in (block for of, block in blocks() if of == page):
        nodes = list(ast.walk(ast.parse(block)))
        known |= {n.asname or n.name.split(".")[0] for n in nodes if isinstance(n, ast.alias)}
        named = [node for node in nodes if isinstance(node, ast.Name)]
        known |= {node.id for node in named if isinstance(node.ctx, ast.Store)}
        assert {node.id for node in named} <= known


def names() -> list[tuple[str, str]]:
    dotted = re.compile(r"`(mplearn(?:_envs|_agents)?(?:\.\w+)+)[(`]")
    return sorted({(page, name) for page, text in TEXTS.items() for name in dotted.findall(text)})


@pytest.mark.parametrize(("page", "name"), names())
def test_dotted_names_are_there(page: str, name: str) -> None:
    room, _, last = name.rpartition(".")
    if room == "mplearn" and last in ENTRY_POINTS:
        return
    parts = name.split(".")
    at = next(at for at in range(len(parts), 0, -1) if is_module(".".join(parts[:at])))
    found = importlib.import_module(".".join(parts[:at]))
    for part in parts[at:]:
        assert hasattr(found, part), f"{page} names {name}, which is not there"
        found = getattr(found, part)


def is_module(name: str) -> bool:
    try:
        return importlib.util.find_spec(name) is not None
    except ModuleNotFoundError:
        return False
