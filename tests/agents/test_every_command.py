"""What every command owes: an example that parses, one line for bad values, inert names."""

import contextlib
import ctypes
import io
import json
import os
import re
import shlex
import signal
import subprocess
import sys
import time
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console
from rich.table import Table

from mplearn import open_recording
from mplearn.errors import RecordingError
from mplearn.library import PrimitiveLibrary
from mplearn.mocap import Hints, command_line, open_takes
from mplearn.option_names import option as option_of
from mplearn_agents import cli
from mplearn_agents.cli import build_parser, command_modules, main
from mplearn_agents.recordings.reading import hints_of, shown_reading
from mplearn_agents.terminal import console as consoles
from mplearn_agents.terminal.console import InertConsole
from mplearn_agents.terminal.inert import InertStream, inert_output, printable
from mplearn_agents.terminal.progress import TimeLeft, open_progress
from mplearn_agents.terminal.tables import primitive_table
from mplearn_envs.data.library_source import LibrarySource

COMMANDS = sorted(command_modules())
HOSTILE = (
    "[/red]", "[bold]", "\x1b[31mred\x1b]0;title\x07", "a\rb\x08c\x7f\x9b2J", "$\\frac{", "\udcff",
    "\u202eevil\u2066", "\u2028line", "<script>alert(1)</script>", ":smile:", "=cmd()|x",
)  # fmt: skip
STEERS = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\u2028\ud800-\udfff]")


def said(capsys, *argv):
    """Run a command and return its exit code, output and errors."""
    try:
        code = main([str(each) for each in argv])
    except SystemExit as stop:
        code = stop.code
    captured = capsys.readouterr()
    return code, captured.out, captured.err


@pytest.mark.parametrize("command", COMMANDS)
def test_the_help_has_an_example_that_parses(command, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    code, out, _ = said(capsys, command, "--help")
    example = command_modules()[command].EXAMPLE
    assert code == 0 and f"example:\n  {example}" in out and "exit codes" in out
    assert all(len(line) <= 80 for line in out.replace(example, "").splitlines())
    words = shlex.split(example.split(" > ")[0])
    assert words[:2] == ["mplearn", command]
    args = build_parser().parse_args(words[1:])
    assert args.run is command_modules()[command].run


def test_the_example_of_evaluate_names_what_there_is(capsys):
    words = shlex.split(command_modules()["evaluate"].EXAMPLE)[1:]
    args = build_parser().parse_args(words)
    code, out, _ = said(capsys, "evaluate", args.data, "--list")
    assert code == 0 and args.only
    assert set(args.only) <= {line.split(":")[0] for line in out.splitlines()}


def test_what_a_library_cannot_do_is_said_before_anything_is_read(tmp_path, capsys):
    path = tmp_path / "acts.mplearn"
    library = LibrarySource(None).now()
    library.save(path)
    code, _, error = said(capsys, "recognise", path, tmp_path / "nothing.c3d")
    assert code == 2 and "no recogniser" in error and "mplearn learn" in error
    one, two = (p.name for p in library.primitives[:2])
    code, _, error = said(capsys, "rename", path, one, two)
    assert code == 2 and f"must differ, not {two}\n" in error


def test_every_action_of_a_store_has_an_example_that_parses(capsys):
    actions = said(capsys, "store", "nothing")[2].split("choose from ")[1].rstrip(")\n")
    for action in actions.replace("'", "").split(", "):
        code, out, _ = said(capsys, "store", action, "--help")
        example = out.split("example:\n")[1].strip()
        assert code == 0 and example.startswith(f"mplearn store {action} life.db")
        assert build_parser().parse_args(shlex.split(example)[1:]).store.name == "life.db"


def test_only_the_named_command_is_asked_what_it_takes(capsys):
    """What takes long to import is imported by who needs it."""
    code = "import sys\nfrom mplearn_agents.cli import main\ntry:\n    main(sys.argv[1:])\n"
    code += "except SystemExit:\n    pass\nprint(*sys.modules, sep='\\n')"
    for words in (["--help"], ["show", "--help"], ["store", "log", "--help"]):
        done = subprocess.run(
            [sys.executable, "-c", code, *words], capture_output=True, text=True, check=True
        )
        loaded = set(done.stdout.split("\n"))
        assert "usage: mplearn" in done.stdout
        assert not loaded & {"numpy", "numba", "rich", "mujoco", "gymnasium", "importlib.metadata"}


def options_with(command, kinds):
    parser = build_parser()
    (choices,) = (a.choices for a in parser._actions if isinstance(a.choices, dict))
    for action in choices[command]._actions:
        kind = {getattr(action.type, "__name__", ""), type(action.type).__name__}
        if action.option_strings and kind & kinds:
            yield action.option_strings[0]


@pytest.mark.parametrize("command", COMMANDS)
def test_bad_values_end_in_one_line_and_code_2(command, capsys):
    bad = ["-5", "x", "9" * 5000, "nan", "\x1b[31m", "1e999", ""]
    for option in options_with(command, {"WholeNumber", "positive", "pace"}):
        for value in bad:
            code, out, err = said(capsys, command, f"{option}={value}")
            assert code == 2 and not out, (option, value)
            assert err.count("\n") == 1 and err.startswith("mplearn"), err
            assert not STEERS.search(err) and len(err) < 1000
    code, _, err = said(capsys, command, "--no-such-option\x1b[31m", "[/red]", "\udcff")
    assert code == 2 and err.count("\n") == 1 and not STEERS.search(err)


def test_seeds_counts_and_rates_are_checked_by_their_options():
    """Plain int and float take -5, 5,000 digits and NaN: no option of ours uses them."""
    for command in COMMANDS:
        assert not list(options_with(command, {"int", "float"}))


@pytest.fixture(scope="module")
def library():
    return LibrarySource(None).now()


@pytest.fixture
def library_file(library, tmp_path):
    return library.save(tmp_path / "library.mplearn")


@pytest.fixture
def hostile_library(library, tmp_path):
    """A library whose names are as bad as a file may hold them; `rename` would refuse them."""
    names = [*(n for n in HOSTILE if n != "\udcff"), *(f"p{k}\x1b[2J" for k in range(100))]
    primitives = tuple(
        replace(each, name=name) for each, name in zip(library.primitives, names, strict=False)
    )
    path = tmp_path / "[bold]\x1b[31m library.mplearn"
    replace(library, primitives=primitives).save(path)
    return path


@pytest.mark.parametrize(
    "arguments",
    [["show"], ["show", "--json"], ["predict", "0"], ["recognise", "none.csv"], ["rename", "0"]],
)
def test_hostile_names_are_inert(arguments, hostile_library, capsys):
    command, *rest = arguments
    library = PrimitiveLibrary.load(hostile_library)
    first = str(library.ids[0])
    rest = [first if each == "0" else each for each in rest]
    if command == "rename":
        rest.append("plain")
    code, out, err = said(capsys, command, hostile_library, *rest)
    assert code == (2 if command == "recognise" else 0), err
    assert not STEERS.search(out) and not STEERS.search(err)
    if arguments == ["show"]:
        assert "[/red]" in out and "[bold]" in out and ":smile:" in out


@pytest.mark.parametrize("name", HOSTILE)
@pytest.mark.parametrize("command", ["show", "rename", "predict", "generate", "recognise", "learn"])
def test_hostile_file_names_and_words_end_in_one_line(command, name, tmp_path, capsys):
    file = tmp_path / f"none{name.replace('/', '|')}"
    rest = {"rename": [name, name], "predict": [name], "recognise": [file]}.get(command, [])
    rest = [name, "--to", f"{file}.csv"] if command == "generate" else rest
    rest = ["--out", file] if command == "learn" else rest
    code, out, err = said(capsys, command, file, *rest)
    assert code == 2 and not out and err.count("\n") == 1
    assert not STEERS.search(err)


def test_hostile_names_do_not_break_a_figure(hostile_library):
    pytest.importorskip("matplotlib")
    pytest.importorskip("jinja2")
    from mplearn_agents.report import library_page, render_page

    library = PrimitiveLibrary.load(hostile_library)
    page = render_page(library_page(library, hostile_library.name))
    assert "<script>alert(1)" not in page
    assert not re.search(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f\u202e\u2066]", page)


def test_a_stream_spells_out_what_would_steer():
    for encoding in ("utf-8", "ascii", "latin-1"):
        raw = io.BytesIO()
        stream = InertStream(io.TextIOWrapper(raw, encoding=encoding, newline=""))
        for name in HOSTILE:
            stream.write(f"{name}é中\n")
        stream.flush()
        text = raw.getvalue().decode(encoding)
        assert text.count("\n") == len(HOSTILE) and not STEERS.search(text.replace("\n", ""))
    assert printable("a\nb\tc") == "a\\nb\\tc" and printable("é中", "") == "é中"


def wide_table():
    table = Table(title="numbers")
    for k in range(12):
        table.add_column(f"column {k}")
    for row in range(3):
        table.add_row(*(f"{row + k + 0.123456789:.9f}" for k in range(12)))
    return table


@pytest.mark.parametrize("width", [26, 40, 80, 119, 400])
def test_tables_are_turned_rather_than_cut(width):
    file = io.StringIO()
    console = InertConsole(file=file, width=width, force_terminal=True, color_system=None)
    console.print(wide_table())
    text = file.getvalue()
    assert "\u2026" not in text
    for row in range(3):
        for k in range(12):
            assert f"{row + k + 0.123456789:.9f}" in text
    assert max(map(len, text.splitlines())) <= width


@pytest.mark.parametrize("width", [40, 66, 80, 100, 400])
def test_texts_are_wrapped_between_words_before_a_table_is_turned(width, library):
    """As long as it is a table every cell is there, word for word, and its numbers in one line."""
    file = io.StringIO()
    console = InertConsole(file=file, width=width, force_terminal=True, color_system=None)
    table = primitive_table(library)
    console.print(table)
    lines = file.getvalue().splitlines()
    assert max(map(len, lines)) <= width
    assert (width >= 80) == any("\u2503 id" in line for line in lines)
    if width < 80:
        return
    rows = []
    for line in lines:
        if line.startswith("\u2502"):
            cells = [cell.strip() for cell in line.strip("\u2502").split("\u2502")]
            rows += [[]] if cells[0] else []
            rows[-1].append(cells)
    assert len(rows) == len(library)
    for primitive, found in zip(library.primitives, rows, strict=True):
        id, name, n, duration, active = (
            " ".join(c for c in part if c) for part in zip(*found, strict=True)
        )
        assert (id, name, n) == (str(primitive.id), primitive.name, str(primitive.n_exemplars))
        assert duration == f"{primitive.mean_duration_s:.2f} s" and len(active.split(", ")) == 3
        assert all(found[0][k] for k in (0, 2, 3)) and len(found) <= 3


def test_a_library_that_resets_colours_at_the_end_prints_nothing(capsys):
    """Numba's colorama writes to the stream that was there when it was imported."""
    with inert_output():
        stream = sys.stdout
    stream.write("\x1b[0m")
    stream.write("a name\x1b[0m\n")
    assert capsys.readouterr().out == "a name\\x1b[0m\n"


@pytest.mark.parametrize("width", [80, 400, 100_000])
def test_names_that_are_spelled_out_are_not_cut(width, library):
    name = "a" + "\u200d" * 9 + "end"
    primitives = tuple(replace(p, name=f"{name}{p.id}") for p in library.primitives)
    file = io.StringIO()
    console = InertConsole(file=file, width=width, force_terminal=True, color_system=None)
    console.print(primitive_table(replace(library, primitives=primitives)))
    for primitive in primitives:
        assert printable(primitive.name) in file.getvalue()


@pytest.mark.parametrize("columns", ["60", "80"])
def test_exit_codes_in_help_fit_the_terminal(columns, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", columns)
    out = said(capsys, "learn", "--help")[1]
    told = out[out.index("exit codes: ") :]
    assert max(map(len, told.splitlines())) <= int(columns)
    assert " ".join(told.split()) == cli._CODES


@pytest.mark.parametrize("columns", ["1", "2", "5"])
def test_no_terminal_is_too_narrow(columns, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", columns)
    out = said(capsys, "learn", "--help")[1]
    assert "interrupted" in out and "SIGTERM" in out


def test_nothing_is_cut_where_the_output_is_no_terminal(monkeypatch):
    monkeypatch.setenv("COLUMNS", "40")
    file = io.StringIO()
    with monkeypatch.context() as patch:
        patch.setattr(sys, "stdout", file)
        consoles.open_console().print(wide_table())
        consoles.open_console().print("word " * 100)
    lines = file.getvalue().splitlines()
    assert ("\u2026" not in file.getvalue() and lines[-1] == ("word " * 100).rstrip()) or lines[-1]
    assert any("0.123456789" in line and "11.123456789" in line for line in lines)


def test_a_bar_moves_in_the_terminal_and_what_is_printed_meanwhile_is_inert(monkeypatch):
    class Terminal(io.StringIO):
        encoding = "utf-8"

        def isatty(self):
            return True

    file = Terminal()
    monkeypatch.setenv("TERM", "xterm")
    with monkeypatch.context() as patch:
        patch.setattr(sys, "stdout", file)
        with inert_output():
            console = consoles.open_console()
            with open_progress(console, "{task.completed:.0f} of {task.total:.0f} steps") as bar:
                task = bar.add_task("walking", total=100)
                bar.update(task, completed=50, refresh=True)
                print("\x1b[2Jhostile")
                console.print("\x1b[3Jtoo")
                bar.update(task, completed=100)
    text = file.getvalue()
    assert "\x1b[2K" in text and "\\x1b[2K" not in text  # lines are cleared, not spelled out
    assert "\\x1b[3Jtoo" in text and "hostile" in text
    assert "\x1b[2J" not in text and "\x1b[3J" not in text
    assert "50 of 100 steps" in text and "100 of 100 steps" in text and " 50 %" in text


@pytest.mark.parametrize(
    ("done", "after_s", "told"), [(0, 3.0, ""), (25, 10.0, "30 s left"), (100, 7.0, "7 s")]
)
def test_a_bar_says_how_long_it_will_take(done, after_s, told):
    now = [0.0]
    with open_progress(Console(file=io.StringIO(), width=80)) as bar:
        bar.get_time = lambda: now[0]
        bar.add_task("walking", total=100)
        (task,) = bar.tasks
        for k in range(1, done + 1):
            now[0] = after_s * k / done
            bar.update(task.id, completed=k)
        assert str(TimeLeft().render(task)) == told


def test_predict_and_generate_agree_with_the_library(library, library_file, tmp_path, capsys):
    names = list(library.names)[:1]
    code, out, _ = said(capsys, "predict", library_file, *names, "--json", "--most", 3)
    assert code == 0
    for row, wanted in zip(json.loads(out), library.predict_next(names, 3), strict=True):
        assert row["primitive"] == wanted.id and row["probability"] == wanted.probability
    path = [library.ids[0], *(p.id for p in library.predict_next([library.ids[0]], 1))]
    wanted = library.generate(path).frames
    for suffix in ("csv", "npz", "bvh"):
        file = tmp_path / f"deep/motion.{suffix}"
        assert said(capsys, "generate", library_file, *path, "--to", file)[0] == 0
        if suffix == "bvh":
            found = open_recording(file, positions=True)
            assert len(found) == len(wanted) and found.rate_hz == pytest.approx(library.rate_hz)
            height = found.frames[:, found.channels.index("pelvis.z")]
            base = library.channels.index("base_height")
            np.testing.assert_allclose(height, wanted[:, base], rtol=0, atol=1e-5)
        elif suffix == "npz":
            with np.load(file) as found:
                np.testing.assert_array_equal(found["frames"], wanted)
                assert tuple(found["channels"]) == library.channels
        else:
            head, *rows = file.read_text().splitlines()
            assert head.split(",") == ["time_s", *library.channels]
            found = np.array([row.split(",") for row in rows], float)
            np.testing.assert_array_equal(found[:, 1:], wanted)
            np.testing.assert_allclose(np.diff(found[:, 0]), 1 / library.rate_hz, atol=1e-8)
    walk = ["generate", library_file, "--walk", 4, "--seed", 3, "--to", tmp_path / "walk.csv"]
    assert "4 primitives" in said(capsys, *walk)[1]
    for bad in ([], [99999], ["9" * 5000], [path[0], "--walk", 2, "--goal", path[1]]):
        code, _, err = said(capsys, "generate", library_file, *bad, "--to", tmp_path / "x.csv")
        assert code == 2 and err.count("\n") == 1 and len(err) < 1000


def test_a_renamed_library_keeps_its_mode_and_its_link(library, library_file, tmp_path, capsys):
    link = tmp_path / "link.mplearn"
    link.symlink_to(library_file)
    library_file.chmod(0o600)
    assert said(capsys, "rename", link, library.ids[0], "another name")[0] == 0
    assert link.is_symlink() and link.resolve() == library_file.resolve()
    assert library_file.stat().st_mode & 0o777 == 0o600
    assert "another name" in PrimitiveLibrary.load(library_file).names
    circle = tmp_path / "circle.mplearn"
    circle.symlink_to(circle)
    from mplearn.errors import LibraryError

    with pytest.raises(LibraryError, match="cannot write"):
        library.save(circle)


def test_the_doctor_says_what_to_do(capsys):
    code, out, err = said(capsys, "doctor", "--json")
    found = {each["what"]: each for each in json.loads(out)}
    assert code == int(any(each["state"] == "wrong" for each in found.values())) and not err
    assert found["library"]["state"] == "ok" and "primitives" in found["library"]["found"]
    for each in found.values():
        assert each["state"] == "ok" or each["advice"]


@pytest.mark.parametrize("shell", ["bash", "zsh", "tcsh"])
def test_completion_knows_every_command(shell, capsys):
    code, out, _ = said(capsys, "completion", shell)
    assert code == 0 and all(command in out for command in COMMANDS)


@pytest.mark.parametrize("error", [ImportError, ctypes.ArgumentError, SystemError, None])
def test_an_interrupt_that_a_library_renames_or_swallows_is_one(monkeypatch, capsys, error):
    def run(argv):
        with contextlib.suppress(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        if error is not None:
            raise error("initialization failed")
        return 0

    monkeypatch.setattr(cli, "_run", run)
    assert main([]) == 130
    assert capsys.readouterr().err == "mplearn: interrupted\n"


def heard_by_c():
    ctypes.CFUNCTYPE(None)(lambda: signal.raise_signal(signal.SIGTERM))()


def swallowed():
    with contextlib.suppress(BaseException):
        signal.raise_signal(signal.SIGTERM)


def handled_as_another():
    try:
        raise ValueError
    except ValueError:
        with contextlib.suppress(BaseException):
            signal.raise_signal(signal.SIGTERM)
        time.sleep(0.3)


@pytest.mark.parametrize("lost", [heard_by_c, swallowed, handled_as_another])
def test_an_interrupt_that_is_lost_comes_again_a_little_later(lost, monkeypatch, capsys):
    ended = []

    def run(argv):
        lost()
        time.sleep(20)
        ended.append("by itself")

    monkeypatch.setattr(cli, "_run", run)
    assert main([]) == 143 and not ended
    assert capsys.readouterr().err == "mplearn: interrupted\n"


def test_what_is_put_away_after_an_interrupt_is_not_interrupted(monkeypatch, capsys):
    """However long it takes, and whatever errors it deals with meanwhile."""
    done = []

    def run(argv):
        try:
            signal.raise_signal(signal.SIGINT)
        finally:
            for _ in range(4):
                time.sleep(0.1)
                with contextlib.suppress(ValueError):
                    raise ValueError
            done.append("put away")

    monkeypatch.setattr(cli, "_run", run)
    assert main([]) == 130 and done
    assert capsys.readouterr().err == "mplearn: interrupted\n"


def test_interrupted_there_is_no_traceback(library_file):
    program = (
        "import sys, mplearn_agents.cli as cli\nprint('on', flush=True)\n"
        "argv = ['perform', sys.argv[1], '--steps', '100000', '--dynamics', 'kinematic']\n"
        "sys.exit(cli.main(argv))"
    )
    for wait_s, number in ((0.05, signal.SIGINT), (1.0, signal.SIGTERM), (1.5, signal.SIGINT)):
        with subprocess.Popen(
            [sys.executable, "-c", program, str(library_file)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env=os.environ | {"PYTHONUNBUFFERED": "1"},
        ) as process:
            process.stdout.readline()
            time.sleep(wait_s)
            process.send_signal(number)
            _, err = process.communicate(timeout=60)
        assert process.returncode == 128 + number, err
        assert err == "mplearn: interrupted\n"


def test_interrupted_while_it_is_loaded_there_is_no_traceback():
    program = (
        "import os, signal, sys\nfrom mplearn_agents.__main__ import main\n"
        "class Finder:\n"
        "    def find_spec(name, path, target=None):\n"
        "        if name == 'mplearn_agents.cli':\n"
        "            print('loading', flush=True), os.kill(os.getpid(), signal.SIGINT)\n"
        "sys.meta_path.insert(0, Finder)\nmain()\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (-signal.SIGINT, "loading\n", "")


@pytest.mark.parametrize("suffix", ["csv", "NPZ", "bvh"])
def test_a_motion_is_written_whole_or_not_at_all(suffix, library_file, tmp_path, capsys):
    """A name in capitals is taken as it is, too."""
    from mplearn import writing

    file = tmp_path / "to" / f"motion.{suffix}"
    argv = ("generate", library_file, 3, "--to", file)
    assert said(capsys, *argv)[0] == 0
    assert [each.name for each in file.parent.iterdir()] == [file.name]
    file.write_bytes(b"precious")

    def interrupt(_):
        raise KeyboardInterrupt

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(writing.os, "fsync", interrupt)
        assert said(capsys, *argv)[0] == 130
    assert [each.read_bytes() for each in file.parent.iterdir()] == [b"precious"]


@pytest.mark.parametrize("name", ["stdout", "stderr"])
def test_a_closed_stream_is_no_traceback(name, library_file, capsys, monkeypatch):
    monkeypatch.setattr(sys, name, None)
    assert main(["show", str(library_file)]) == 0
    assert main(["show", "nowhere.mplearn"]) == 2
    assert "Traceback" not in "".join(capsys.readouterr())


def test_who_reads_no_more_is_no_fault(library_file):
    program = "import sys\nfrom mplearn_agents.cli import main\nsys.exit(main(sys.argv[1:]))"
    with subprocess.Popen(
        [sys.executable, "-c", program, "show", str(library_file)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as process:
        process.stdout.close()
        assert process.stderr.read() == b""
    assert process.returncode == 0


def test_streams_are_put_back():
    before = sys.stdout, sys.stderr
    with inert_output():
        assert sys.stdout is not before[0]
    assert (sys.stdout, sys.stderr) == before


def test_reading_many_takes_shows_how_far_it_is(tmp_path):
    for name in ("one", "two", "three"):
        rows = "".join(f"{k / 50:.2f},{k % 7}\n" for k in range(100))
        (tmp_path / f"{name}.csv").write_text("time_s,elbow\n" + rows)
    (tmp_path / "torn.csv").write_text("time_s,elbow\n0.1,up\n")
    for terminal in (True, False):
        shown = io.StringIO()
        with shown_reading(Console(file=shown, force_terminal=terminal, width=80)) as through:
            takes = open_takes(tmp_path, through=through)
        assert [each.name for each in takes.recordings] == ["one", "three", "two"]
        assert list(takes.unreadable) == ["torn"]
        assert ("reading" in shown.getvalue() and "4 of 4" in shown.getvalue()) == terminal
    with pytest.raises(RecordingError, match="torn"):
        open_takes(tmp_path, strict=True, through=lambda names: reversed(list(names)))


HINTS = {
    "rate_hz": (("--rate", "90"), 90.0),
    "unit_m": (("--unit", "in"), 0.0254),
    "up_axis": (("--up", "-y"), "-y"),
    "skeleton": (("--skeleton", "a.asf"), Path("a.asf")),
    "angle_unit": (("--angles", "radians"), "radians"),
    "mirrored": (("--mirrored",), True),
    "level": (("--level",), True),
}  # of each attribute of `Hints`: an option, and what it says


@pytest.mark.parametrize("words", [("learn", "x"), ("inspect", "x"), ("recognise", "l", "x")])
def test_the_command_line_takes_the_hints_that_python_takes(words):
    """None is left out on either side, and messages name the option that there is."""
    asked = {each.name for each in fields(Hints)} - {"joint_axes"}  # of what is drawn, no hint
    assert asked == HINTS.keys()
    parser = build_parser(words)
    bare = vars(parser.parse_args(words))
    for name, (words_of, value) in HINTS.items():
        args = parser.parse_args([*words, *words_of])
        assert hints_of(args) == replace(Hints(), **{name: value})
        with command_line():
            assert option_of(name) == words_of[0]
        assert {key for key in bare if vars(args)[key] != bare[key]} == {words_of[0].strip("-")}
    (group,) = (
        each
        for each in parser._subparsers._group_actions[0].choices[words[0]]._action_groups
        if each.title == "what the files do not say, or say wrongly"
    )
    known = {words_of[0] for words_of, _ in HINTS.values()} | {"--map"}
    assert {action.option_strings[0] for action in group._group_actions} == known
