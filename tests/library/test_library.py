from itertools import pairwise

import numpy as np
import pytest
from library_examples import CHANNELS, RATE, example_library, example_primitive

from mplearn.errors import InvalidValueError, UnknownPrimitiveError
from mplearn.graph import TransitionGraph
from mplearn.library import CompactMotion, Primitive, PrimitiveLibrary


def test_primitives_are_found_by_id_and_by_name():
    assert example_library()[3] is example_library()["P3"]
    assert example_library().names == tuple(f"P{id}" for id in example_library().ids)
    assert [primitive.id for primitive in example_library()] == list(example_library().ids)
    assert "P3" in example_library()
    assert "bow" not in example_library()
    with pytest.raises(UnknownPrimitiveError, match="no primitive 'bow' in the library; it holds"):
        example_library()["bow"]


def test_renaming_returns_another_library():
    renamed = example_library().rename("P3", "bow down")
    assert renamed["bow down"].id == 3
    assert "P3" in example_library()
    assert "P3" not in renamed
    assert renamed.version != example_library().version
    assert renamed.rename(3, "P3").version == example_library().version
    assert renamed["bow down"].exemplars[0] is example_library()[3].exemplars[0] or np.array_equal(
        renamed["bow down"].exemplars[0], example_library()[3].exemplars[0]
    )
    for wrong in ("", "  ", "a\nb", "P4"):
        with pytest.raises(InvalidValueError):
            example_library().rename(3, wrong)


def test_the_graph_answers_by_name_too():
    walk = example_library().walk("P0", 12, np.random.default_rng(0))
    assert len(walk) == 12
    assert walk == example_library().graph.walk(0, 12, np.random.default_rng(0))
    path = example_library().path("P0", 3, avoid=["P5"])
    assert path == example_library().graph.path(0, 3, avoid=[5])
    assert example_library().k_paths(0, "P3", 2) == example_library().graph.k_paths(0, 3, 2)
    assert example_library().predict_next(["P0", None, 1], 2) == example_library().graph.predict(
        [0, None, 1], 2
    )
    with pytest.raises(InvalidValueError, match="no recogniser"):
        example_library().recognise(example_library()[0].exemplars[0])


def test_the_library_does_not_change_when_its_source_does():
    graph = example_library().graph.copy()
    library = PrimitiveLibrary(example_library().primitives, graph, CHANNELS, RATE)
    version = library.version
    graph.observe(0, 1, 1.0)
    assert library.graph.count(0, 1) == example_library().graph.count(0, 1)
    again = PrimitiveLibrary(library.primitives, library.graph, CHANNELS, RATE)
    assert again.version == version
    with pytest.raises(InvalidValueError, match="snapshot"):
        library.graph.observe(0, 1, 1.0)
    for array in (library[0].hmm.means, library[0].exemplars[0], library[0].kept[0].knots):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


@pytest.mark.parametrize("style", ["deterministic", "nearest", "averaged", "smooth"])
def test_a_path_becomes_a_trajectory_within_limits(style):
    walk = example_library().walk(None, 6, np.random.default_rng(4))
    limits = np.full(len(CHANNELS), 1.5)
    motion = example_library().generate(
        walk,
        style=style,
        speed=0.5,
        velocity_limits=limits,
        acceleration_limits=20 * limits,
        start=np.zeros(len(CHANNELS)),
        rate_hz=50.0,
        rng=np.random.default_rng(0),
    )
    assert motion.path == walk
    assert motion.rate_hz == 50.0
    assert motion.channels == CHANNELS
    assert (np.abs(motion.velocities) <= 1.5).all()
    assert (np.abs(motion.accelerations) <= 30).all()
    expected_s = sum(example_library()[id].mean_duration_s for id in walk)
    assert motion.duration_s >= 2 * expected_s - 1.0
    np.testing.assert_allclose(motion.frames[0], 0.0, atol=1e-5)


def test_a_disconnected_path_can_be_asked_for_too():
    assert example_library().generate(["P0", "P0"]).path == (0, 0)


def test_exemplars_are_kept_nearly_as_they_were():
    rng = np.random.default_rng(0)
    t = np.arange(150)[:, None] / RATE
    frames = np.sin(2 * np.pi * t * np.array([0.5, 1.0, 3.0])) * np.array([1e-3, 1.0, 900.0])
    compact = CompactMotion.of(frames, RATE)
    assert compact.knots.nbytes < frames.nbytes / 14
    error = np.abs(compact.frames - frames).max(axis=0) / np.abs(frames).max(axis=0)
    assert (error < 0.03).all()
    noisy = CompactMotion.of(frames + 0.01 * rng.standard_normal(frames.shape), RATE)
    assert noisy.frames.shape == frames.shape
    for n in (1, 2, 3, 4):
        short = CompactMotion.of(frames[:n], RATE)
        np.testing.assert_allclose(short.frames, frames[:n], rtol=1e-3, atol=0.02)
    still = CompactMotion.of(np.full((100, 2), [0.0, 3.25]), RATE)
    np.testing.assert_allclose(still.frames, np.full((100, 2), [0.0, 3.25]), atol=1e-9)
    slow = CompactMotion.of(frames[::5], 20.0)
    np.testing.assert_allclose(slow.frames, frames[::5], atol=0.05, rtol=1e-3)


def test_primitives_keep_the_most_usual_exemplars_and_no_gaps():
    source = example_primitive(1, 0, 1)
    motions = [source.exemplars[0]] * 3 + [np.repeat(source.exemplars[0], 3, axis=0)]
    motions[0] = motions[0].copy()
    motions[0][10:20, 0] = np.nan
    made = Primitive.from_exemplars(1, source.hmm, motions, RATE, max_kept=3, parent=7)
    assert made.n_exemplars == 4
    assert len({len(frames) for frames in made.exemplars}) == 1
    assert all(np.isfinite(frames).all() for frames in made.exemplars)
    assert made.mean_duration_s == pytest.approx(np.mean([len(f) for f in motions]) / RATE)
    assert made.parent == 7
    for wrong in ([], [np.zeros((20, 2))], [np.full((20, len(CHANNELS)), np.inf)]):
        with pytest.raises(InvalidValueError):
            Primitive.from_exemplars(1, source.hmm, wrong, RATE)


def test_what_does_not_fit_together_is_no_library():
    graph = TransitionGraph()
    graph.add_node(77)
    one = example_library()[0]
    for primitives, with_graph, channels, rate, match in (
        ((one, one), TransitionGraph(), CHANNELS, RATE, "ids of a library"),
        ((one,), graph, CHANNELS, RATE, "77"),
        ((one,), TransitionGraph(), CHANNELS[:-1], RATE, "channels"),
        ((one,), TransitionGraph(), ("x",) * len(CHANNELS), RATE, "channels"),
        ((one,), TransitionGraph(), CHANNELS, 50.0, "rate_hz"),
    ):
        with pytest.raises(InvalidValueError, match=match):
            PrimitiveLibrary(primitives, with_graph, channels, rate)


def test_walks_of_the_example_follow_observed_edges():
    for i, j in pairwise(example_library().walk(None, 50, np.random.default_rng(1))):
        assert example_library().graph.count(i, j) > 0
