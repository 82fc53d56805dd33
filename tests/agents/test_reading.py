"""Takes as people have them, at the door of the commands: options, bad takes, odd rates."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mplearn.demonstrator import demonstrate
from mplearn.errors import FrameError, RecordingError
from mplearn.learner import LearnerConfig, MotionLearner
from mplearn.library import PrimitiveLibrary
from mplearn.mocap import join_by_name
from mplearn.recording import Recording, marker_channels
from mplearn_agents.cli import main
from mplearn_agents.learning.watched import learn


@pytest.fixture(scope="module")
def motion() -> Recording:
    return demonstrate(["BAR", "BAL"], 2, rate_hz=50.0).recording


def write(path: Path, recording: Recording, factor: float = 1.0, every: int = 1) -> Path:
    times = np.arange(len(recording)) / recording.rate_hz
    rows = np.column_stack([times, recording.frames * factor])[::every]
    header = ",".join(["time", *recording.channels])
    np.savetxt(path, rows, delimiter=",", fmt="%.5f", header=header, comments="")
    path.write_text(path.read_text().replace("nan", ""))
    return path


def test_one_bad_take_costs_nothing_but_itself(
    motion: Recording, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "takes"
    folder.mkdir()
    write(folder / "a.csv", motion)
    write(folder / "c.csv", motion)
    alone = tmp_path / "alone.mplearn"
    assert main(["learn", str(folder), "--out", str(alone)]) == 0
    (folder / "b.csv").write_text("time,LASI.x\n0,what\n")
    (folder / "d.c3d").write_bytes(b"P" * 3000)
    out = tmp_path / "x.mplearn"
    assert main(["learn", str(folder), "--out", str(out)]) == 0
    said = capsys.readouterr().out
    assert "left out: b:" in said
    assert "left out: d:" in said
    assert "from 2 takes" in said
    assert PrimitiveLibrary.load(out).ids == PrimitiveLibrary.load(alone).ids
    assert main(["learn", str(folder), "--strict", "--out", str(out)]) == 2
    assert "b.csv" in capsys.readouterr().err


def test_a_take_that_cannot_be_learned_costs_nothing_but_itself(
    motion: Recording,
) -> None:
    from rich.console import Console

    angles = Recording(motion.frames[:, :6], 50.0, tuple("abcdef"), name="whole")
    other = replace(angles, channels=tuple("abcdeg"), name="other")
    learner, quiet = MotionLearner(LearnerConfig(angles.channels, 50.0)), Console(quiet=True)
    log = learn(learner, [angles, other, angles], quiet)
    assert list(log.refused) == ["other"]
    assert learner.n_frames == 2 * len(angles)
    with pytest.raises(FrameError, match="'other'"):
        learn(learner, [angles, other, angles], quiet, strict=True)
    with pytest.raises(FrameError, match="'other'"):
        learn(learner, [other], quiet)


def test_a_take_of_nobody_costs_nothing_but_itself(motion: Recording) -> None:
    from rich.console import Console

    nobody = replace(
        motion,
        frames=np.random.default_rng(0).normal(0.0, 1.0, motion.frames.shape),
        name="nobody",
    )
    config = LearnerConfig(channels=motion.channels, rate_hz=motion.rate_hz)
    learner, alone = MotionLearner(config), MotionLearner(config)
    quiet = Console(quiet=True)
    log = learn(learner, [motion, nobody, motion], quiet)
    expected = learn(alone, [motion, motion], quiet)
    assert len(log.segments) == len(expected.segments)
    assert log.lost or log.refused


@pytest.mark.parametrize("factor", [1.0, 25.4])
def test_options_say_what_a_file_does_not(
    motion: Recording, tmp_path: Path, capsys: pytest.CaptureFixture[str], factor: float
) -> None:
    path = write(tmp_path / "a.csv", motion, factor)
    out = ["--out", str(tmp_path / "x.mplearn")]
    assert main(["learn", str(path), *out, "--unit", str(1 / factor), "--up", "z"]) == 0
    capsys.readouterr()
    assert main(["learn", str(path), *out, "--unit", "parsec"]) == 2
    assert "--unit must be one of m," in capsys.readouterr().err
    assert main(["learn", str(path), *out, "--up", "w"]) == 2
    assert "--up must be one of x," in capsys.readouterr().err
    assert main(["learn", str(path), *out, "--unit", "1000"]) == 2
    assert "--unit sets it" in capsys.readouterr().err


def test_messages_name_the_option_of_the_interface(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "a.csv"
    path.write_text("knee,hip\n1,2\n3,4\n")
    assert main(["learn", str(path), "--out", str(tmp_path / "x.mplearn")]) == 2
    err = capsys.readouterr().err
    assert "--rate" in err
    assert "Hints" not in err


def test_rates_that_cannot_be_learned_are_resampled(
    motion: Recording, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write(tmp_path / "a.csv", motion)
    out = tmp_path / "x.mplearn"
    for rate, learned in (("500", "250"), ("15", "30")):
        assert main(["learn", str(path), "--rate", rate, "--out", str(out)]) == 0
        assert f"resampled from {rate} to {learned} Hz" in capsys.readouterr().out


def test_takes_are_joined_by_name() -> None:
    rng = np.random.default_rng(0)

    def take(name: str, markers: str) -> Recording:
        frames = rng.normal(size=(4, 3 * len(markers)))
        return Recording(frames, 50.0, marker_channels(tuple(markers)), name=name)

    takes = [take("a", "ABCD"), take("b", "DCBA"), take("c", "CBA"), take("d", "AXYZ")]
    joined = join_by_name([*takes, take("e", "ABCD")])
    assert [each.name for each in joined.recordings] == ["a", "b", "c", "e"]
    assert list(joined.refused) == ["d"]
    assert isinstance(joined.refused["d"], RecordingError)
    assert joined.dropped == ("D",)
    for before, after in zip(takes[:3], joined.recordings, strict=False):
        assert after.marker_names == ("A", "B", "C")
        for name in "ABC":
            at = before.marker_names.index(name)
            assert np.array_equal(after.markers[:, "ABC".index(name)], before.markers[:, at])
    plain = [Recording(np.ones((3, 2)), 50.0, names) for names in (("p", "q"), ("q", "p"))]
    assert join_by_name(plain).recordings[1].channels == ("p", "q")


def test_what_was_shown_once_is_kept_to_be_performed_and_said(
    motion: Recording, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "library.mplearn"
    take = write(tmp_path / "take.csv", motion)
    assert main(["learn", str(take), "--out", str(out)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "0 primitives from 1 takes" in said and "Why:" in said
    assert "2 motions that were shown once are in the library" in said
    assert [each.n_exemplars for each in PrimitiveLibrary.load(out).primitives] == [1, 1]
    assert main(["perform", str(out), "--steps", "2", "--dynamics", "kinematic"]) == 0
    assert "2 primitives" in capsys.readouterr().out
    assert main(["learn", str(take), "--out", str(out), "--demonstrations", "0"]) == 2
    assert "--demonstrations must be at least 1, not 0" in capsys.readouterr().err


def test_a_take_in_which_nothing_moves_is_kept_as_its_posture(
    motion: Recording, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "library.mplearn"
    frames = np.repeat(motion.frames[20:21], 150, axis=0)
    take = write(tmp_path / "take.csv", replace(motion, frames=frames, labels=()))
    assert main(["learn", str(take), "--out", str(out)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "1 takes in which nothing moved are in the library" in said
    library = PrimitiveLibrary.load(out)
    assert [each.n_exemplars for each in library.primitives] == [1]
    assert library.primitives[0].mean_duration_s == pytest.approx(2.0)
    assert library.recognise(library.primitives[0].exemplars[0]).primitive is None
    assert main(["perform", str(out), "--steps", "1", "--dynamics", "kinematic"]) == 0
