import csv
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from mplearn.demonstrator import demonstrate
from mplearn.errors import InvalidValueError, RecordingError
from mplearn.recording import Recording
from mplearn_agents.cli import main
from mplearn_agents.evaluations import Setting, evaluations_for

RATE_HZ = 30.0
POSTURES = {"rest": (0.0, 0.0, 0.0), "up": (1.2, 0.1, -0.4), "side": (-0.3, 1.1, 0.9)}


def moved(names):
    """Frames from posture to posture in a second each, shape (30 * n, 3), and their labels."""
    rise = 0.5 - 0.5 * np.cos(np.linspace(0, np.pi, round(RATE_HZ)))[:, None]
    frames, labels = [], []
    for a, b in pairwise(names):
        start, end = np.array(POSTURES[a]), np.array(POSTURES[b])
        frames.append(start + rise * (end - start))
        labels += [f"{a}-{b}"] * len(rise)
    return np.concatenate(frames), labels


def write(path, frames, labels, segments):
    with path.open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(["time", "label", "segment", "x", "y", "z"])
        for t, (row, label, segment) in enumerate(zip(frames, labels, segments, strict=True)):
            table.writerow([f"{t / RATE_HZ:.4f}", label, segment, *row])


def test_labels_of_primitives_are_learned_as_they_come(tmp_path, capsys):
    rng = np.random.default_rng(1)
    way = ["rest"]
    for _ in range(24):
        way.append(str(rng.choice([name for name in POSTURES if name != way[-1]])))
    frames, labels = moved(way)
    frames += rng.normal(0, 0.01, frames.shape)
    write(tmp_path / "one.csv", frames, labels, np.arange(len(frames)) // round(RATE_HZ))
    assert main(["evaluate", str(tmp_path), "--list"]) == 0
    assert "prediction" in capsys.readouterr().out
    assert main(["evaluate", str(tmp_path), "--only", "learning", "--out", str(tmp_path)]) == 0
    (table,) = tmp_path.glob("*.md")
    assert "one" in table.read_text()


def test_a_take_of_one_repetition_is_left_out_of_repeated_movements(tmp_path):
    for name, times in (("many", 4), ("few", 3), ("single", 1)):
        frames, labels = moved(["rest", "up", "rest"] + ["up", "rest"] * (times - 1))
        repetitions = np.arange(len(frames)) // (2 * round(RATE_HZ))
        write(tmp_path / f"{name}.csv", frames, [name] * len(labels), repetitions)
    setting = Setting(str(tmp_path))
    assert setting.kind == "repetitions"
    assert [take.name for take in setting.takes] == ["few", "many"]
    assert setting.left_out == ("single",)
    assert "together" in evaluations_for(setting)


def test_too_short_repetitions_cannot_be_evaluated(tmp_path):
    write(tmp_path / "short.csv", np.zeros((16, 3)), ["m"] * 16, np.arange(16) // 8)
    with pytest.raises(InvalidValueError, match="no two labelled repetitions"):
        _ = Setting(str(tmp_path)).takes


def test_markers_without_labels_show_inverse_kinematics():
    shown = replace(demonstrate(("BAD", "BAU"), 1).recording, labels=())
    markers, angles = Setting("markers"), Setting("angles")
    markers.__dict__["recordings"] = (shown,)
    assert list(evaluations_for(markers)) == [
        "rhythm",
        "rates",
        "loops",
        "glitches",
        "peers",
        "inverse-kinematics",
    ]
    (table,) = evaluations_for(markers)["inverse-kinematics"](markers)
    assert [row[1] for row in table.rows] == ["human", "robot"]
    assert all(float(row[3].removesuffix(" mm")) < 20 for row in table.rows)
    angles.__dict__["recordings"] = (Recording(np.zeros((50, 1)), 100.0, ("knee",)),)
    with pytest.raises(RecordingError, match="no recording has labels"):
        evaluations_for(angles)


def test_tables_of_labels_beside_recordings_are_read_and_bad_ones_named(tmp_path, capsys):
    frames, labels = moved(["rest", "up"] * 8 + ["rest", "side"] * 8)
    with (tmp_path / "one.csv").open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(["time", "x", "y", "z"])
        table.writerows([f"{t / RATE_HZ:.4f}", *row] for t, row in enumerate(frames.tolist()))
    half = len(labels) // 2
    (tmp_path / "by_hand.json").write_text(
        f'{{"one": {{"up": [[0, {half}]], "side": [[{half}, {len(labels)}]]}}}}'
    )
    (tmp_path / "broken.json").write_text("{")
    (tmp_path / "longer.json").write_text('{"one": {"up": [[0, 100000]]}}')
    assert main(["evaluate", str(tmp_path), "--only", "exercises", "--out", str(tmp_path)]) == 0
    said = "".join(capsys.readouterr().out.split())
    assert "leftout:broken.json" in said and "leftout:one(longer)" in said
    (table,) = tmp_path.glob("*.md")
    assert "one (by_hand)" in table.read_text() and "2 of 2" in table.read_text()


def test_a_take_of_which_a_channel_is_lost_does_not_end_the_others(tmp_path):
    for name in ("good", "lost"):
        frames, labels = moved(["rest", "up"] * 4)
        write(tmp_path / f"{name}.csv", frames, [name] * len(labels), np.arange(len(frames)) // 60)
    setting = Setting(str(tmp_path))
    good, lost = setting.recordings
    frames = lost.frames.copy()
    frames[:, 1] = np.nan
    setting.__dict__["recordings"] = (good, replace(lost, frames=frames))
    assert [take.name for take in setting.takes] == ["good"]
    assert "never seen" in str(setting.refused["lost"])
