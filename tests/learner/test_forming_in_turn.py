"""A frame forms one primitive at most: all is as if all had been formed at once, a frame later."""

import math
from dataclasses import replace

import numpy as np
import pytest

from mplearn import LearnerConfig, MotionLearner
from mplearn.errors import StateError
from mplearn.learner import PrimitiveBorn, PrimitiveSplit, SegmentClosed
from mplearn.people import PeopleTree
from mplearn.state import from_plain, to_plain
from mplearn.tree import ROOT, TreeConfig

RATE_HZ, D, N, T = 50.0, 6, 6, 60
CHANNELS = tuple(f"joint_{k}" for k in range(D))
TIME = np.sin(np.outer(np.linspace(0, np.pi, T), [1, 2, 3])) ** 3
TOGETHER = (8, 6, 7, 9, 10, 6, 7, 11)


def shown(seed=0, kinds=TOGETHER, off=0.18):
    """Six kinds five times, then two in a sequence that came twice, and known ones; with rests."""
    rng = np.random.default_rng(seed)
    shapes = np.random.default_rng(0).normal(0, 1, (30, D, 3))
    rest, order = np.zeros((14, D)), [*(k % N for k in range(5 * N)), *kinds, 0, 1]
    kinds = [shapes[k] + rng.normal(0, off if k >= N else 0.1, (D, 3)) for k in order]
    return np.concatenate([rest, *(part for kind in kinds for part in (TIME @ kind.T, rest))])


def learner(**rules):
    return MotionLearner(LearnerConfig(CHANNELS, RATE_HZ, tree=replace(TreeConfig(), **rules)))


def one_by_one(learner, frames):
    """Return the events of each frame, and how many primitives it formed but by splits."""
    events, formed = [], [0]
    for frame in frames:
        events.append(learner.learn_one(frame))
        formed.append(sum(node.parent == ROOT for node in learner.tree.nodes))
    return events, np.diff(formed)


@pytest.fixture
def at_once(monkeypatch):
    """Return what learners do that form all with the segment, as before; events a frame."""

    def learned(frames, **rules):
        insert = PeopleTree.insert
        with monkeypatch.context() as patch:
            patch.setattr(
                PeopleTree,
                "insert",
                lambda tree, frames, person, *, goes_on, in_turn: insert(
                    tree, frames, person, goes_on=goes_on
                ),
            )
            before = learner(**rules)
            return before, *one_by_one(before, frames)

    return learned


def flat(events):
    return [event for each in events for event in each]


def formed_by(events):
    """Return the primitives that events say were formed, but by splits."""
    born = {e.primitive for e in events if isinstance(e, PrimitiveBorn)}
    return born.difference(*(e.into for e in events if isinstance(e, PrimitiveSplit)))


@pytest.mark.parametrize(("seed", "rules"), [(0, {}), (4, {}), (2, {"max_born": 3})])
def test_a_frame_forms_one_and_all_is_as_if_at_once(at_once, seed, rules):
    frames = shown(seed)
    before, events_before, formed_before = at_once(frames, **rules)
    now = learner(**rules)
    events, formed = one_by_one(now, frames)
    assert max(formed_before) == 2 and max(formed) == 1
    assert flat(events) == flat(events_before)
    births = sum(bool(formed_by(each)) for each in events_before)
    late = [
        k
        for k, (a, b) in enumerate(zip(events, events_before, strict=True))
        if b and len(b) > len(a)
    ]
    assert len(late) == births > N  # just what forms something is said later
    most = int(now.config.tree.max_born) - 1
    for k in late:
        at = next(i for i in range(1, most + 1) if events[k + i])
        assert events[k + at][: len(events_before[k])] == events_before[k]
    assert before.state() == now.state()
    assert before.end_stream() == now.end_stream()
    assert before.snapshot().version == now.snapshot().version


def test_many_frames_and_one_a_time_say_the_same():
    frames = shown()
    one, many = learner(max_born=3), learner(max_born=3)
    events, _ = one_by_one(one, frames)
    assert many.learn_many(frames) == flat(events)
    assert many.state() == one.state()


def moments(frames):
    """Frames after which something is to form, and the learner there."""
    going = learner()
    for k, frame in enumerate(frames):
        going.learn_one(frame)
        if going.tree.to_form:
            yield k + 1, going


def test_who_is_kept_before_all_is_formed_goes_on_bit_for_bit():
    frames = shown()
    whole = learner()
    events, _ = one_by_one(whole, frames)
    n = 0
    for at, going in moments(frames):
        n += 1
        if n % 3:
            continue
        state = going.state()
        again = MotionLearner.from_state(state, lazily=n % 2 == 0)
        assert again.state() == state and state.closing is not None
        assert going.snapshot().version == again.snapshot().version
        assert again.learn_many(frames[at:]) == flat(events[at:])
        assert again.state() == whole.state()
    assert n > N


def test_the_end_forms_all_and_so_does_a_hand(at_once):
    frames = shown()
    for at, going in [(at, MotionLearner.from_state(g.state())) for at, g in moments(frames)][-2:]:
        before, events, _ = at_once(frames[:at])
        ended = MotionLearner.from_state(going.state())
        assert ended.end_stream() == [*events[-1], *before.end_stream()]
        assert not ended.tree.to_form and ended.state() == before.state()
        before, _, _ = at_once(frames[:at])
        assert going.merge(1, 2) == before.merge(1, 2)
        assert going.state() == before.state()
        assert going.learn_one(frames[at]) == [*events[-1], *before.learn_one(frames[at])]


def test_what_is_lost_right_after_does_not_lose_what_was_closed(at_once):
    frames = shown()
    for at in [at for at, _ in moments(frames)][::3]:
        lost = frames.copy()
        lost[at : at + 40] = np.nan
        before, events, _ = at_once(frames[:at])
        expected = [*flat(events), *before.learn_many(lost[at:])]
        now = learner()
        assert now.learn_many(lost) == expected
        assert now.state() == before.state()


def test_a_state_in_which_something_is_wrong_with_what_is_closing_is_refused():
    _, going = next(moments(shown()))
    state = going.state()
    segment, placement = state.closing
    wrong = {
        "closing": [
            None,
            *(
                state.closing._replace(placement=placement._replace(**each))
                for each in (
                    {"number": 3},
                    {"node_id": 99},
                    {"born": (77,)},
                    {"nearest": 99},
                    {"like": 1_000},
                )
            ),
            state.closing._replace(segment=replace(segment, end=10**6)),
        ],
        "tree": [
            replace(state.tree, trees=(replace(each, tree=replace(each.tree, to_form=n)),))
            for each in state.tree.trees
            for n in (0, 2)
        ],
    }
    for name, values in wrong.items():
        for value in values:
            with pytest.raises(StateError, match=r"closing|to_form"):
                MotionLearner.from_state(replace(state, **{name: value}))
    plain = to_plain(state, whole=True)
    assert from_plain(type(state), plain, whole=True) == state
    assert sum(isinstance(e, SegmentClosed) for e in going.end_stream()) >= 1
    assert math.isfinite(going.config.tree.max_born)
