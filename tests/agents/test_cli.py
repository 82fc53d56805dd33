"""The command: its answers, and what it says to bad input."""

import subprocess
import sys

import pytest

from mplearn.library import PrimitiveLibrary
from mplearn_agents.cli import main


def refused(capsys, *argv):
    """Return the one line that the command says before it exits with 2."""
    assert main([str(each) for each in argv]) == 2
    captured = capsys.readouterr()
    assert captured.err.startswith("mplearn: ")
    assert captured.err.count("\n") == 1
    return captured.err


def test_show_lists_primitives_transitions_and_tree(library, library_file, capsys):
    assert main(["show", str(library_file)]) == 0
    said = capsys.readouterr().out
    for primitive in library.primitives:
        assert said.count(primitive.name) >= 3
    assert "BAL 100 %" in said  # BAR is always followed by BAL
    assert library.version in said


def test_rename_changes_the_name_and_nothing_else(library, library_file, capsys):
    id = library["BAR"].id
    assert main(["rename", str(library_file), "BAR", "both [up]"]) == 0
    renamed = PrimitiveLibrary.load(library_file)
    assert renamed[id].name == "both [up]"
    assert renamed.rename(id, "BAR").version == library.version
    assert main(["rename", str(library_file), str(id), "BAR"]) == 0
    assert PrimitiveLibrary.load(library_file).version == library.version
    capsys.readouterr()
    main(["rename", str(library_file), "BAR", "both [up]"])
    main(["show", str(library_file)])
    assert "both [up]" in capsys.readouterr().out


def test_perform_walks(library_file, capsys):
    assert main(["perform", str(library_file), "--steps", "3", "--policy", "greedy"]) == 0
    assert "3 primitives in" in capsys.readouterr().out


def test_perform_shows_primitives_and_survives_a_push(library_file, capsys):
    push = ["--push", "36", "--towards", "forward-left"]
    assert main(["perform", str(library_file), "--show", "hold", "BAR", *push]) == 0
    said = capsys.readouterr().out.splitlines()
    assert [line.split()[1].rstrip(",") for line in said[:3]] == ["hold", "BAR", "hold"]
    assert "steps" in said[0] and "steps" not in said[2] and "1 primitive in" in said[3]
    assert said[3].endswith("0 falls")
    assert "--push pushes what" in refused(capsys, "perform", library_file, "--push", "9")
    assert "jump" in refused(capsys, "perform", library_file, "--show", "jump")
    show = ("perform", library_file, "--show", "BAR")
    assert "give --push" in refused(capsys, *show, "--towards", "left")
    said = refused(capsys, *show, "--steps", "3", "--upper-body")
    assert "takes no --steps, --upper-body" in said


def test_perform_writes_a_film(renderer, library_file, tmp_path):
    # in a process of its own: MuJoCo chooses its graphics library when it is imported
    video = tmp_path / "walk.mp4"
    command = [
        sys.executable,
        "-m",
        "mplearn_agents.cli",
        "perform",
        library_file,
        "--steps",
        "1",
        "--speed",
        "1",
        "--balance",
    ]
    done = subprocess.run([*command, "--video", video], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "film of" in done.stdout
    assert video.stat().st_size > 5000


def test_bad_input_is_one_line_and_exit_code_2(library_file, tmp_path, capsys):
    assert "no file" in refused(capsys, "show", tmp_path / "none.mplearn")
    broken = tmp_path / "broken.mplearn"
    broken.write_bytes(b"nothing of the kind")
    assert "damaged" in refused(capsys, "show", broken)
    assert "no primitive 'XYZ'" in refused(capsys, "rename", library_file, "XYZ", "name")
    assert "printable" in refused(capsys, "rename", library_file, "BAR", " ")
    assert "at least 1 step" in refused(capsys, "perform", library_file, "--steps", "0")
    assert "give --video" in refused(capsys, "perform", library_file, "--balance")
    assert "robot must be one of" in refused(capsys, "perform", library_file, "--robot", "nao")
    assert "need each other" in refused(capsys, "perform", library_file, "--goal", "BAR")
    assert "no primitive 'jump'" in refused(
        capsys, "perform", library_file, "--policy", "path", "--goal", "jump"
    )
    out = tmp_path / "x.mplearn"
    assert "no such file" in refused(capsys, "learn", tmp_path / "none.csv", "--out", out)
    assert not out.exists()


def test_an_unknown_command_is_refused_by_the_parser(capsys):
    with pytest.raises(SystemExit) as stop:
        main(["dance"])
    assert stop.value.code == 2
    assert "invalid choice: 'dance'" in capsys.readouterr().err


def test_help_needs_no_heavy_import():
    code = (
        "import sys\nfrom mplearn_agents.cli import main\n"
        "try:\n    main(['--help'])\nexcept SystemExit:\n    pass\n"
        "heavy = {'mujoco', 'matplotlib', 'dm_control', 'torch', 'hmmlearn', 'filterpy'}\n"
        "sys.exit(','.join(heavy & set(sys.modules)) or 0)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "perform" in done.stdout
