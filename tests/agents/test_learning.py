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
from mplearn.recording import Segment
from mplearn_agents.cli import main
from mplearn_agents.learning import LearningLog


def test_a_log_counts_what_lives():
    log = LearningLog()
    segments = [Segment(10 * k, 10 * k + 10, still=k == 1) for k in range(5)]
    for segment in segments:
        log.note(SegmentClosed(segment))
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
    assert "minutes must lie in (0, 60]" in capsys.readouterr().err


def test_the_score_counts_as_the_paper_does():
    """Twelve performances of two kinds; each rate by hand."""
    from mplearn.recording import LabelledSegment
    from mplearn_agents.demo.score import score_learning

    labels = "AABABABABAAB"
    truth = [LabelledSegment(20 * k, 20 * k + 20, label) for k, label in enumerate(labels)]
    log = LearningLog()
    for k in range(12):
        shift = 12 if k == 10 else 1  # the eleventh is cut in the wrong place
        log.note(SegmentClosed(Segment(20 * k + shift, 20 * k + shift + 19)))
    at = {segment.start // 20: segment for segment in log.segments}
    log.note(PrimitiveBorn(at[3], 1, 3))  # A, known from frame 80
    log.note(PrimitiveBorn(at[4], 2, 3))  # B, known from frame 100
    for k, primitive in {5: 1, 6: 1, 7: 2, 8: 2, 9: 1, 11: 2}.items():
        log.note(Recognised(at[k], primitive, 0.1))
    # performed: 4 B, 5 A, 6 B, 7 A, 8 B, 9 A, 10 A, 11 B
    score = score_learning(log, truth, {1, 2})
    assert score.performed == {"A": 7, "B": 5}
    assert score.classes == {1: "A", 2: "B"}
    assert score.extracted == ("A", "B")
    assert score.recognised == {1: 3, 2: 3}
    assert score.right == {1: 2, 2: 2}  # 6 was a B, 7 was an A
    assert score.false_positive == pytest.approx(2 / 6)
    assert score.false_negative == pytest.approx(1 / 7)  # 10 of 5, 6, 7, 8, 9, 10, 11
    assert score.coverage == pytest.approx(4 / 12)
