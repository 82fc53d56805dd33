"""Who stands there: synthetic people before the cameras, one after another."""

import numpy as np
import pytest

from mplearn.body import MotionObserver
from mplearn.body.marker_sets.rigid import distances_of, rigid_pairs
from mplearn.body.observer.identity import BodyIdentity, IdentityConfig
from mplearn.body.observer.observer import BLOCK_FRAMES
from mplearn.demonstrator import Person, demonstrate
from mplearn.errors import BodyError, InvalidValueError
from mplearn.merging import merge_observers
from mplearn.merging.bodies import merge_bodies
from mplearn.recording import Recording

SIZES = {"small": 1.58, "middle": 1.70, "tall": 1.84}


@pytest.fixture(scope="module")
def people() -> dict[str, Recording]:
    """Three people who raise and lower an arm and bow."""
    script = ("RAR", "RAL", "BAD", "BAU")
    return {
        name: demonstrate(script, seed=i, person=Person(name, height)).recording
        for i, (name, height) in enumerate(SIZES.items())
    }


@pytest.fixture(scope="module")
def stream(people: dict[str, Recording]) -> tuple[np.ndarray, list[tuple[int, int]]]:
    """Pieces of their motion, each going on where that person was; frames and true changes."""
    at = dict.fromkeys(people, 0)
    pieces, truth, names, length = [], [], [], 0
    for name, n in [("small", 300), ("tall", 200), ("small", 90), ("middle", 150), ("tall", 120)]:
        pieces.append(people[name].frames[at[name] : at[name] + n])
        at[name] += n
        if name not in names:
            names.append(name)
        truth.append((length, names.index(name)))
        length += n
    return np.concatenate(pieces), truth


def watch(observer: MotionObserver, frames: np.ndarray):
    """Return all features, and who they were of: the first row and the number."""
    rows, seen, arrivals = [], [], 0
    for frame in frames:
        features = observer.update(frame)
        if len(features) and observer.arrivals != arrivals:
            arrivals = observer.arrivals
            seen.append((sum(map(len, rows)), observer.person))
        rows.append(features)
    rows.append(observer.flush())
    return np.concatenate(rows), seen


def test_people_are_told_apart_and_recognised_when_they_come_back(people, stream):
    frames, truth = stream
    features, seen = watch(MotionObserver(people["small"].marker_names, 100.0), frames)
    assert len(features) == len(frames)
    assert [person for _, person in seen] == [person for _, person in truth]
    assert max(abs(a - b) for (a, _), (b, _) in zip(seen, truth, strict=True)) <= 3
    assert np.isfinite(features).all()


def test_who_comes_back_is_followed_on_the_body_fitted_before(people, stream):
    frames, truth = stream
    features, _ = watch(MotionObserver(people["small"].marker_names, 100.0), frames)
    alone = MotionObserver(people["small"].marker_names, 100.0).observe(people["small"].frames)
    assert np.array_equal(features[:300], alone[:300])
    again = features[truth[2][0] + 10 : truth[3][0]] - alone[310:390]
    assert np.abs(again[:, 0]).max() < 0.01
    assert np.median(np.abs(again)) < 0.02


def test_one_person_is_one_person(people):
    for recording in people.values():
        observer = MotionObserver(recording.marker_names, 100.0)
        _, seen = watch(observer, recording.frames)
        assert seen == [(0, 0)]


def calls(observer: MotionObserver, frames: np.ndarray) -> int:
    """Return in how many steps frames were taken: one a frame while there is a doubt."""
    n = 0
    while len(frames):
        frames = frames[observer.watch(frames[:BLOCK_FRAMES]).taken :]
        n += 1
    return n


@pytest.mark.parametrize("noise", [0.005, 0.01, 0.02])
def test_noise_in_the_markers_raises_one_doubt_and_is_learned(people, noise):
    recording = people["middle"]
    shaken = recording.frames + np.random.default_rng(3).normal(0, noise, recording.frames.shape)
    clean, observer = (MotionObserver(recording.marker_names, 100.0) for _ in range(2))
    fewest, look = calls(clean, recording.frames), observer.identity.look_frames
    assert calls(observer, shaken) <= fewest + 2 * look
    assert observer.person == 0 and observer.identity.n_people == 1
    spread = np.sqrt(observer.state().identity.memory.spread)
    expected = np.sqrt(2) * noise  # of the difference of two places, along the line between them
    assert 0.8 * expected < np.median(spread) < 1.4 * expected


def test_a_saved_observer_goes_on_in_the_middle_of_a_doubt(people, stream):
    frames, truth = stream
    for at in (truth[1][0] + 4, truth[1][0] + 30):
        one = MotionObserver(people["small"].marker_names, 100.0)
        for frame in frames[:at]:
            one.update(frame)
        other = MotionObserver(people["small"].marker_names, 100.0)
        other.load_state(one.state())
        for frame in frames[at : at + 60]:
            assert np.array_equal(one.update(frame), other.update(frame))
        assert one.person == other.person


def test_a_new_stream_recognises_people(people):
    observer = MotionObserver(people["small"].marker_names, 100.0)
    for name in ("small", "tall", "small", "tall"):
        watch(observer, people[name].frames[:250])
        assert observer.person == ("small", "tall").index(name)
        observer.restart()
    assert observer.person == -1


def test_a_gap_of_the_whole_body_changes_nobody(people):
    frames = people["tall"].frames.copy()
    frames[200:260] = np.nan
    observer = MotionObserver(people["tall"].marker_names, 100.0)
    features, seen = watch(observer, frames)
    assert seen == [(0, 0)]
    assert len(features) == len(frames)


def test_one_more_than_can_be_told_apart_is_the_nearest(people):
    observer = MotionObserver(
        people["small"].marker_names, 100.0, identity=IdentityConfig(max_people=2)
    )
    for name in ("small", "tall", "middle"):
        watch(observer, people[name].frames[:200])
        assert observer.person in (0, 1)
        observer.restart()
    assert observer.identity.n_people == 2


def test_merged_observers_know_more_people_than_one_tells_apart(people):
    rules, names = IdentityConfig(max_people=2), people["small"].marker_names
    one, two = (MotionObserver(names, 100.0, identity=rules) for _ in range(2))
    for observer, seen in ((one, ("small", "tall")), (two, ("middle",))):
        for name in seen:
            watch(observer, people[name].frames[:200])
            observer.restart()
    state, numbers = merge_observers(one, two, {}, ())
    assert numbers == {0: 2}
    merged = MotionObserver(names, 100.0, identity=rules)
    merged.load_state(state)
    for number, name in enumerate(("small", "tall", "middle")):
        watch(merged, people[name].frames[:200])
        assert merged.person == number
        merged.restart()
    assert merged.identity.n_people == 3


@pytest.mark.parametrize("at", [0, 1, 2])
def test_who_came_and_went_at_once_is_matched_with_nobody(people, at):
    names = people["small"].marker_names
    one, two = (BodyIdentity(names, 100.0).bodies for _ in range(2))
    seen = {
        name: distances_of(take.markers[50], rigid_pairs(names)[0]) for name, take in people.items()
    }
    for bodies, order in ((one, ["small", "middle"]), (two, ["middle", "small"])):
        order.insert(at, "nobody")
        bodies.n_people = len(order)
        for person, name in enumerate(order):
            for _ in range(20 * (name in seen)):
                bodies.learn(person, seen[name])
    first = [k for k in range(3) if k != at]
    _, numbers = merge_bodies(one, two, {}, ())
    assert numbers == {first[0]: first[1], first[1]: first[0], at: 3}


def test_rigid_pairs_share_a_segment_and_keep_their_distance(people):
    recording = people["small"]
    pairs, give = rigid_pairs(recording.marker_names)
    assert len(pairs) == len(give) >= 20
    names = [{recording.marker_names[i] for i in pair} for pair in pairs]
    assert {"LFHD", "RFHD"} in names
    assert {"LFHD", "LTOE"} not in names
    seen = np.array([distances_of(markers, pairs) for markers in recording.markers])
    i, j = pairs.T
    truth = np.linalg.norm(recording.markers[:, i] - recording.markers[:, j], axis=2)
    assert np.allclose(seen, truth, equal_nan=True)
    assert np.nanstd(seen, axis=0).max() < 0.006


def test_what_cannot_be_is_refused(people):
    with pytest.raises(BodyError):
        BodyIdentity(("a", "b"), 100.0)
    with pytest.raises(InvalidValueError, match="strikes"):
        IdentityConfig(strikes=0)
    with pytest.raises(InvalidValueError, match="person"):
        BodyIdentity(people["small"].marker_names, 100.0).meet(4)
