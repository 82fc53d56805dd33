"""``mplearn inspect`` says what was read and who was recognised, and draws it."""

import json

import pytest
from rigs import Rig, write_rig

from mplearn_agents.cli import main


@pytest.fixture
def take(tmp_path, truth):
    return write_rig(
        tmp_path / "take.bvh", truth.body, truth.postures[:80], 25.0, Rig(fingers=True)
    )


def test_what_was_recognised_as_what(take, capsys):
    assert main(["inspect", str(take), "--json", "--no-picture"]) == 0
    (facts,) = json.loads(capsys.readouterr().out)
    assert facts["format"] == "BVH" and facts["frames"] == 80
    assert facts["rate_hz"] == pytest.approx(25.0)
    assert facts["recognised"]["knee_l"] == ["LeftLeg"]
    assert "thumb2_l" in facts["left_out"] and not facts["problem"]
    assert 0.0 <= facts["fit_m"] < 0.01
    assert facts["unseen"] == []


def test_text_names_the_person_and_the_picture_is_written(take, tmp_path, capsys):
    picture = tmp_path / "sticks.png"
    assert main(["inspect", str(take), "--picture", str(picture)]) == 0
    said = capsys.readouterr().out
    assert "a person of" in said and "knee_l = LeftLeg" in said
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_a_map_is_heard_and_a_wrong_one_refused(take, tmp_path, capsys):
    told = tmp_path / "map.txt"
    told.write_text("Neck = -\n")
    assert main(["inspect", str(take), "--json", "--no-picture", "--map", str(told)]) == 0
    assert "neck" not in json.loads(capsys.readouterr().out)[0]["recognised"]
    told.write_text("Neck = nek\n")
    assert main(["inspect", str(take), "--no-picture", "--map", str(told)]) == 2
    assert "there are neck" in capsys.readouterr().err


def test_one_bad_take_does_not_cost_the_others(take, tmp_path, capsys):
    (tmp_path / "bad.bvh").write_text("HIERARCHY\n")
    assert main(["inspect", str(tmp_path), "--json", "--no-picture"]) == 0
    good, bad = json.loads(capsys.readouterr().out)
    assert good["take"] == "take" and bad["take"] == "bad" and bad["problem"]


def test_names_do_not_steer_the_terminal_nor_the_picture(take, tmp_path, capsys):
    wild = tmp_path / "[red]$\\frac{$\x1b[31m.bvh"
    wild.write_text(take.read_text().replace("thumb2_l", "\x1b]0;[bold]thumb2_l"))
    picture = tmp_path / "sticks.png"
    assert main(["inspect", str(wild), "--picture", str(picture)]) == 0
    said = capsys.readouterr().out
    assert "\x1b" not in said
    assert "[red]$\\frac{$\\x1b[31m: BVH" in said and "\\x1b]0;[bold]thumb2_l" in said
    assert picture.exists()
    wild.write_text("\x1b[31mHIERARCHY\nMOTION\n")
    assert main(["inspect", str(wild), "--no-picture"]) == 2
    assert "\x1b" not in capsys.readouterr().err


@pytest.mark.filterwarnings("error")
def test_a_take_of_nobody_is_drawn_with_the_reason_in_its_picture(tmp_path, capsys):
    bone = "OFFSET 0 0 9\nCHANNELS 3 Xrotation Yrotation Zrotation\nEnd Site\n{ OFFSET 0 0 90 }\n"
    motion = "MOTION\nFrames: 2\nFrame Time: 0.01\n0 0 0\n0 0 9\n"
    (tmp_path / "rod.bvh").write_text(f"HIERARCHY\nROOT Rod\n{{\n{bone}}}\n{motion}")
    picture = tmp_path / "rod.png"
    assert main(["inspect", str(tmp_path / "rod.bvh"), "--picture", str(picture)]) == 0
    assert "(2 joints: Rod, Rod_end): two legs" in capsys.readouterr().out
    from matplotlib.pyplot import imread

    dark = imread(picture)[..., :3].max(axis=2) < 0.3
    assert dark.any(axis=1).sum() > 20  # lines of text, not the name alone
