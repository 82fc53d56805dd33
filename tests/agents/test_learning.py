"""What a log makes of events, and the commands that learn."""

import subprocess
import sys

import numpy as np
import pytest

from mplearn.learner import (
    PrimitiveBorn,
    PrimitiveMerged,
    PrimitiveSplit,
    Recognised,
    SegmentClosed,
    TransitionSeen,
)
from mplearn.library import PrimitiveLibrary
from mplearn.recording import LabelledSegment, Segment
from mplearn.tree import Placement
from mplearn_agents.cli import main
from mplearn_agents.demo.score import score_learning
from mplearn_agents.learning.watched import LearningLog


def test_a_log_counts_what_lives():
    log = LearningLog()
    segments = [Segment(10 * k, 10 * k + 10, still=k == 1) for k in range(5)]
    for segment in segments:
        log.note(SegmentClosed(segment, None))
    log.note(PrimitiveBorn(segments[0], 3, 4))
    log.note(PrimitiveBorn(segments[2], 4, 4))
    log.note(Recognised(segments[2], 3, 0.5))
    log.note(TransitionSeen(segments[2], 4, 3, 1))
    log.note(PrimitiveSplit(segments[3], 3, (5, 6)))
    log.note(PrimitiveBorn(segments[3], 5, 3))
    log.note(PrimitiveBorn(segments[3], 6, 3))
    log.note(PrimitiveMerged(segments[4], 5, 4))
    assert log.n_primitives == 2
    assert log.known == [(10, 1), (30, 2), (40, 2), (40, 3), (50, 2)]
    assert log.recognised == {20: 3}
    assert len(log.moving) == 4


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    """A file of markers, as a user has it."""
    from mplearn.demonstrator import demonstrate

    recording = demonstrate(["BAR", "BAL", "SQD", "SQR"] * 12, 5, rate_hz=50.0).recording
    path = tmp_path_factory.mktemp("data") / "take.csv"
    times = np.arange(len(recording)) / recording.rate_hz
    rows = np.column_stack([times, recording.frames])
    header = ",".join(["time_s", *recording.channels])
    np.savetxt(path, rows, delimiter=",", fmt="%.5f", header=header, comments="")
    path.write_text(path.read_text().replace("nan", ""))
    return path


def test_learn_show_rename_perform(table, tmp_path, capsys):
    out = tmp_path / "new" / "learned.mplearn"
    assert main(["learn", str(table), "--out", str(out)]) == 0
    said = capsys.readouterr().out
    library = PrimitiveLibrary.load(out)
    assert 2 <= len(library) <= 6
    assert f"{len(library)} primitives from 1 takes" in said
    assert main(["show", str(out)]) == 0
    assert main(["rename", str(out), str(library.ids[0]), "first of all"]) == 0
    assert PrimitiveLibrary.load(out)[library.ids[0]].name == "first of all"
    capsys.readouterr()
    assert main(["perform", str(out), "--steps", "2"]) == 0
    assert "2 primitives in" in capsys.readouterr().out


def test_settings_of_the_learner_are_options():
    from mplearn.errors import InvalidValueError
    from mplearn.learner import LearnerConfig
    from mplearn_agents.commands.learn import with_settings

    config = LearnerConfig(("a",))
    assert with_settings(config, []) is config
    found = with_settings(config, ["tree.max_chains=3", "segmenter=zero-velocity", "rate_hz=50"])
    assert (found.tree.max_chains, found.segmenter, found.rate_hz) == (3, "zero-velocity", 50.0)
    assert with_settings(config, ["tree.durations=explicit"]).tree.durations == "explicit"
    for wrong, said in (
        ("tree.max_chains", "NAME=VALUE"),
        ("three.max_chains=3", "no settings 'three'"),
        ("tree.maxchains=3", "maxchains"),
        ("tree.max_chains=many", "tree.max_chains"),
        ("tree.durations=long", "geometric"),
    ):
        with pytest.raises(InvalidValueError, match=said):
            with_settings(config, [wrong])


def test_learn_refuses_what_it_cannot_learn_from(table, tmp_path, capsys):
    out = ["--out", str(tmp_path / "x.mplearn")]
    assert main(["learn", str(table), "--person", "nobody", *out]) == 2
    assert "no take of nobody" in capsys.readouterr().err
    assert main(["learn", str(table), "--segmenter", "magic", *out]) == 2
    assert "'magic'" in capsys.readouterr().err
    assert main(["learn", str(table), "--rate-hz", "5", *out]) == 2
    assert "5" in capsys.readouterr().err
    assert not (tmp_path / "x.mplearn").exists()


def test_the_demo_writes_its_report(renderer, tmp_path):
    # in a process of its own: MuJoCo chooses its graphics library when it is imported
    command = [sys.executable, "-m", "mplearn_agents.cli", "demo", "--out", tmp_path]
    short = ["--minutes", "2.5", "--steps", "2"]
    done = subprocess.run([*command, *short], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    for said in ("real time", "against the paper", "17 of 22", "walking", "report.html"):
        assert said in done.stdout
    html = (tmp_path / "report.html").read_text(encoding="utf-8")
    for section in ("walk", "learned", "segmentation", "curves", "tree", "graph"):
        assert f'<section id="{section}">' in html
    assert "data:video/mp4;base64," in html
    assert len(PrimitiveLibrary.load(tmp_path / "library.mplearn")) > 0
    for name in ("walk.mp4", "film.png", "tree.png", "graph.png", "curves.png", "stream.png"):
        assert (tmp_path / name).stat().st_size > 2000


def test_the_demo_without_a_renderer_does_the_rest(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("mplearn_agents.demo.run.choose_backend", lambda: False)
    assert main(["demo", "--out", str(tmp_path), "--minutes", "2.5", "--steps", "1"]) == 0
    assert "no off-screen renderer" in capsys.readouterr().out
    html = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "no off-screen renderer" in html
    assert "<video" not in html
    assert '<section id="graph">' in html
    assert not (tmp_path / "walk.mp4").exists()


def test_the_demo_refuses_a_length_that_is_none(tmp_path, capsys):
    assert main(["demo", "--out", str(tmp_path), "--minutes", "0"]) == 2
    assert "--minutes must be positive, not 0" in capsys.readouterr().err
    assert main(["demo", "--out", str(tmp_path), "--minutes", "61"]) == 2
    assert "minutes must lie in (0, 60]" in capsys.readouterr().err


def placed(number, node, *, recognised=False, born=(), moved=()):
    return Placement(number, node, recognised, 0.1, 0.5, born=born, moved=moved)


def test_the_score_tells_what_was_recognised_rightly():
    truth = [LabelledSegment(20 * k, 20 * k + 20, label) for k, label in enumerate("AABABB")]
    log = LearningLog()
    placements = [
        placed(0, 0),
        placed(1, 1, born=(1,), moved=((0, 1),)),
        placed(2, 2, born=(2,)),
        placed(3, 1, recognised=True),
        placed(4, 2, recognised=True),
        placed(5, 1, recognised=True),  # a B, taken for an A
    ]
    for t, placement in zip(truth, placements, strict=True):
        segment = Segment(t.start + 1, t.end)
        log.note(SegmentClosed(segment, placement))
        if placement.recognised:
            log.note(Recognised(segment, placement.node_id, 0.1))
    score = score_learning(log, truth, rate_hz=50.0)
    assert score.classes == {1: "A", 2: "B"}
    assert score.performed == {"A": 3, "B": 3}
    assert score.recognised == {1: 2, 2: 1}
    assert score.right == {1: 1, 2: 1}
    assert [score.shows[s.start] for s in log.segments] == list("AABABB")
    assert score.rates.n_wrong == 1
