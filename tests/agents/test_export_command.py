"""``mplearn export`` as a user types it."""

import json

import numpy as np
import pytest

from mplearn_agents.cli import main


def test_a_path_goes_out_and_is_in_order(tmp_path, capsys):
    out = tmp_path / "bow.npz"
    assert main(["export", "--to", "mjlab", "--walk", "2", "--out", str(out)]) == 0
    assert "1 motion of robot" in capsys.readouterr().out
    assert main(["export", "--check", str(out)]) == 0
    assert "in order" in capsys.readouterr().out
    with np.load(out) as file:
        arrays = dict(file)
    arrays["joint_pos"] = np.degrees(arrays["joint_pos"])
    np.savez(out, **arrays)
    assert main(["export", "--check", str(out)]) == 1
    said = capsys.readouterr().out
    assert "degrees, not radians" in said and "off by" in said
    assert main(["export", "--check", str(out), "--json"]) == 1
    (verdict,) = json.loads(capsys.readouterr().out)
    assert verdict["faults"][0]["kind"] == "degrees" and verdict["left_m"] < 1e-5


@pytest.mark.parametrize(
    ("words", "problem"),
    [
        (["--to", "nonsense"], "--to must be one of unitree"),
        ([], "give --to FORMAT"),
        (["--to", "bvh", "--check", "a.bvh"], "no --to"),
        (["--check", "not there.bvh"], "no such file"),
        (["--to", "bvh", "--robot", "nobody"], "nobody"),
        (["--to", "bvh", "--robot", "mine.xml"], "FILE.toml"),
        (["--to", "bvh", "--rate", "-3"], "positive"),
        (["not there.mplearn", "--to", "bvh"], "not there.mplearn"),
    ],
)
def test_what_makes_no_sense_is_refused_in_a_line(words, problem, capsys):
    assert main(["export", *words]) == 2
    error = capsys.readouterr().err
    assert problem in error and error.count("\n") == 1
