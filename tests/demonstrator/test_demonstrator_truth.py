"""Truth, scripts, streams, repeatability, bad input."""

import hashlib
import subprocess
import sys
import tracemalloc
from itertools import islice, pairwise

import networkx as nx
import numpy as np
import pytest

from mplearn.body import human_body, marker_set
from mplearn.body.kinematics.kernels import points_of_postures
from mplearn.demonstrator import (
    PAPER_PRIMITIVES,
    PRIMITIVES,
    SEQUENCING,
    Demonstrator,
    Person,
    Variability,
    demonstrate,
    followers,
    markov_script,
)
from mplearn.errors import InvalidValueError

# what the robot performs in the paper, section 4.2.2
PAPERS_WALK = (
    *("LAR", "LAL", "BAD", "BAU", "RAR", "RAL", "BAD", "BAU", "RAR", "RAL"),
    *("SQD", "SQR", "LAR", "LAL", "BAD", "BAU", "BAR", "BAL", "RAR"),
)


def marker_speed(shown):
    """Root mean square speed of the noiseless markers, (T - 1,) [m/s]."""
    body = human_body()
    bodies, offsets = marker_set("paper34").attach(body.tree)
    markers = points_of_postures(shown.posture.frames, body.tree.linkage, bodies, offsets)
    velocity = np.diff(markers, axis=0) * shown.posture.rate_hz
    return np.sqrt((velocity**2).sum(axis=2).mean(axis=1))


@pytest.fixture(scope="module")
def performance():
    script = markov_script(160, np.random.default_rng(1), balance=0.5)
    return script, demonstrate(script, 17)


def test_truth_names_the_script_and_its_pauses_are_long(performance):
    script, shown = performance
    assert tuple(segment.label for segment in shown.truth) == script
    assert shown.recording.labels == shown.truth
    gaps = np.array([b.start - a.end for a, b in pairwise(shown.truth)])
    assert (gaps >= 0).all()
    assert ((gaps == 0) | (gaps >= 30)).all()
    assert 1 <= (gaps >= 30).sum() <= 0.2 * len(script)
    assert shown.truth[-1].end <= len(shown.recording)


def test_truth_cuts_where_the_body_is_slow_and_covers_the_motion(performance):
    _, shown = performance
    speed = marker_speed(shown)
    peaks = np.array([speed[s.start : s.end - 1].max() for s in shown.truth])
    for edge in ("start", "end"):
        frames = np.array([getattr(s, edge) for s in shown.truth])
        at = speed[np.minimum(frames, len(speed) - 1)]
        assert np.median(at / peaks) < 0.12
        assert np.quantile(at / peaks, 0.95) < 0.35
    outside = np.ones(len(speed), bool)
    for segment in shown.truth:
        outside[segment.start : segment.end] = False
    still = Variability(sway=0.0, drift_rad=0.0)
    script = [s.label for s in shown.truth]
    speed = marker_speed(demonstrate(script, 17, variability=still))
    assert speed[outside].sum() < 0.01 * speed.sum()


def test_a_lone_motion_is_seen_for_most_of_its_time():
    shown = demonstrate(["BAR"], 0, variability=Variability.none())
    (segment,) = shown.truth
    speed = marker_speed(shown)
    moving = np.flatnonzero(speed > 0.05 * speed.max())
    assert abs(segment.start - moving[0]) <= 3 and abs(segment.end - moving[-1]) <= 3
    assert 0.7 * 1.45 < (segment.end - segment.start) / 100 < 1.45


def test_the_stream_gives_the_frames_of_the_recording():
    script = ["SQD", "SQR", "LAR", "LAL", "BAD", "BAU"]
    person = Person.random(np.random.default_rng(2))
    shown = demonstrate(script, 9, person=person)
    live = Demonstrator(person, 9)
    frames = np.array(list(live.stream(iter(script))))
    np.testing.assert_array_equal(frames, shown.recording.frames)
    np.testing.assert_array_equal(np.array(list(live.stream(script))), frames)
    assert live.channels == shown.recording.channels
    truth = [segment for block in live.blocks(script) for segment in block.truth]
    assert tuple(truth) == shown.truth


def test_an_endless_stream_keeps_nothing():
    live = Demonstrator(seed=3).blocks()
    for _ in islice(live, 60):
        pass
    tracemalloc.start()
    try:
        for _ in islice(live, 20):
            pass
        before = tracemalloc.get_traced_memory()[0]
        n_frames = sum(len(block.markers) for block in islice(live, 150))
        grown = tracemalloc.get_traced_memory()[0] - before
    finally:
        tracemalloc.stop()
    assert n_frames > 10_000
    assert grown < 1_000_000  # the frames themselves would be 8 MB


def test_the_frame_rate_changes_nothing_but_the_sampling():
    script = ["MRL", "MLR", "MMID", "RAR", "RAL"]
    slow, fast = (demonstrate(script, 4, rate_hz=rate).posture for rate in (50.0, 100.0))
    n = min(len(slow), len(fast.frames[::2]))
    np.testing.assert_allclose(slow.frames[:n], fast.frames[::2][:n], atol=1e-9)
    for a, b in zip(slow.labels, fast.labels, strict=True):
        assert abs(2 * a.start - b.start) <= 2 and abs(2 * a.end - b.end) <= 2


def test_same_seed_same_bits_in_a_new_process():
    code = (
        "import hashlib, numpy as np; from mplearn.demonstrator import *;"
        "p = Person.random(np.random.default_rng(5));"
        "s = markov_script(12, np.random.default_rng(6));"
        "d = demonstrate(s, 7, person=p);"
        "print(hashlib.sha256(d.recording.frames.tobytes() + d.posture.frames.tobytes()"
        " + repr(d.truth).encode()).hexdigest())"
    )
    out = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=120
    )
    shown = demonstrate(
        markov_script(12, np.random.default_rng(6)),
        7,
        person=Person.random(np.random.default_rng(5)),
    )
    here = hashlib.sha256(
        shown.recording.frames.tobytes()
        + shown.posture.frames.tobytes()
        + repr(shown.truth).encode()
    ).hexdigest()
    assert out.stdout.strip() == here
    other = demonstrate(markov_script(12, np.random.default_rng(6)), 8)
    assert other.recording.frames.shape != shown.recording.frames.shape


def test_the_papers_types_and_structure():
    assert len(PAPER_PRIMITIVES) == 22 and set(SEQUENCING) == set(PAPER_PRIMITIVES)
    figure_10 = {
        *("LKR", "MMID", "MRL", "BAR", "BAD", "BAU", "RAR", "LAR", "LAL"),
        *("RAL", "BAL", "AR", "RKR", "LPR", "SQD", "MLR", "SQR"),
    }
    assert figure_10 < set(PAPER_PRIMITIVES)
    assert all(second in SEQUENCING[first] for first, second in pairwise(PAPERS_WALK))
    assert set(SEQUENCING["BAD"]) == {"BAU"} and set(SEQUENCING["SQD"]) == {"SQR"}
    assert set(SEQUENCING["LAL"]) == {"BAD", "SQD"}
    graph = nx.DiGraph([(a, b) for a, options in SEQUENCING.items() for b in options])
    assert nx.is_strongly_connected(graph)
    for options in SEQUENCING.values():
        assert sum(options.values()) == pytest.approx(1.0)
    for name in PRIMITIVES:
        assert followers(name)


def test_markov_scripts_follow_the_weights():
    script = markov_script(20_000, np.random.default_rng(0))
    assert script == markov_script(20_000, np.random.default_rng(0))
    pairs = list(pairwise(script))
    for first, options in SEQUENCING.items():
        after = [second for name, second in pairs if name == first]
        assert set(after) == set(options)
        for second, weight in options.items():
            share, error = after.count(second) / len(after), np.sqrt(1 / len(after))
            assert abs(share - weight) < 2.5 * error


def test_balance_evens_the_counts():
    even = markov_script(2000, np.random.default_rng(1), balance=0.5)
    counts = np.array([even.count(name) for name in SEQUENCING])
    assert counts.min() > 0.9 * counts.mean() and counts.max() < 1.1 * counts.mean()


def test_impossible_scripts_are_refused():
    with pytest.raises(InvalidValueError, match=r"XYZ.*BAR, BAL"):
        demonstrate(["XYZ"], 0)
    with pytest.raises(InvalidValueError, match="at least one of BAR"):
        demonstrate([], 0)
    with pytest.raises(InvalidValueError, match=r"'BAD' at index 1 .* followed by BAL"):
        demonstrate(["BAR", "BAD"], 0)
    with pytest.raises(InvalidValueError, match="followed by BAL"):
        list(Demonstrator().stream(["BAR", "BAD"]))
    with pytest.raises(InvalidValueError, match="at least one"):
        list(Demonstrator().stream([]))


@pytest.mark.parametrize("seed", [-1, 1.0, "1", None, True, np.float64(3)])
def test_bad_seeds_are_refused(seed):
    with pytest.raises(InvalidValueError, match="seed"):
        demonstrate(["BAR"], seed)


@pytest.mark.parametrize("rate_hz", [-100.0, 0.0, 5.0, np.nan, np.inf, "100", None])
def test_bad_rates_are_refused(rate_hz):
    with pytest.raises(InvalidValueError, match="rate_hz"):
        demonstrate(["BAR"], 0, rate_hz=rate_hz)


@pytest.mark.parametrize(
    "values",
    [
        {"noise_m": -0.001},
        {"duration": 0.9},
        {"fluid": 0.8, "pause": 0.3},
        {"pause_s": (1.0, 0.5)},
        {"occlusion": np.nan},
        {"occlusion_s": (0.0, 0.1)},
    ],
)
def test_bad_variability_is_refused(values):
    with pytest.raises(InvalidValueError, match=next(iter(values))):
        Variability(**values)


@pytest.mark.parametrize(
    "values",
    [{"tempo": {"XYZ": 1.0}}, {"reach": {"bow": -1.0}}, {"rest": {"elbow_l": np.nan}}],
)
def test_bad_persons_are_refused(values):
    with pytest.raises(InvalidValueError, match=next(iter(values))):
        Person(**values)


@pytest.mark.parametrize(
    "graph",
    [
        {"BAR": {"BAD": 1.0}, "BAD": {"BAU": 1.0}},
        {"BAR": {"BAL": 1.0}, "BAL": {}},
        {"BAR": {"BAL": 1.0}},
        {"BAR": {"BAL": 1.0}, "BAL": {"BAR": 0.0}},
        {"LPE": {"LPR": 1.0}, "LPR": {"LPE": 1.0}},
        {"XYZ": {"BAR": 1.0}},
    ],
)
def test_impossible_graphs_are_refused(graph):
    with pytest.raises(InvalidValueError):
        markov_script(3, np.random.default_rng(0), graph)


@pytest.mark.parametrize("length", [0, -3, 2.0, True])
def test_bad_lengths_are_refused(length):
    with pytest.raises(InvalidValueError, match="length"):
        markov_script(length, np.random.default_rng(0))
