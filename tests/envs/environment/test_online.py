"""The online environment, whose library grows while the robot acts, and live libraries."""

import copy
import pickle

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from standing_library import RATE_HZ, recording, standing_library

import mplearn_envs  # noqa: F401  (registers the environments)
from mplearn import LearnerConfig, MotionLearner, Recording
from mplearn.errors import InvalidValueError, LibraryError
from mplearn_envs.checks import check_action_mask
from mplearn_envs.environment.live_demonstrator import RecordingDemonstrator, SyntheticDemonstrator
from mplearn_envs.robot import humanoid
from mplearn_envs.skills.slots import Slots
from mplearn_envs.tasks import FreeTask

ID = "mplearn/OnlinePrimitiveHumanoid-v0"
GIVEN = "mplearn/PrimitiveHumanoid-v0"


def make(**options):
    defaults = {"demonstrator": recording(), "dynamics": "kinematic", "warm_up_s": 20.0}
    return gymnasium.make(ID, **(defaults | options))


def told(info):
    """Return what the learner did."""
    return {name: np.asarray(value).tolist() for name, value in info["learner"].items()}


def episode(env, n, seed=0):
    """Return infos of a random walk by the prior, and a digest of all that was seen."""
    observation, info = env.reset(seed=seed)
    rng = np.random.default_rng(seed)
    infos, seen = [info], []
    for _ in range(n):
        action = rng.choice(len(info["action_mask"]), p=info["transition_prior"])
        observation, reward, _, _, info = env.step(action)
        infos.append(info | {"known": env.unwrapped.library.ids})
        seen.append((float(reward), observation["posture"].tobytes(), told(info)))
    return infos, seen


def test_what_the_demonstrator_shows_becomes_legal():
    env = make(warm_up_s=0.0)
    infos, _ = episode(env, 70)
    first, last = infos[0], infos[-1]
    assert first["action_mask"].sum() == 1 and first["learner"]["n_primitives"] == 0
    assert last["learner"]["n_primitives"] >= 4
    watched = [info["learner"]["watched_s"] for info in infos]
    spent = np.cumsum([info.get("duration_s", 0.0) for info in infos])
    np.testing.assert_allclose(watched, spent, atol=0.011)  # both lives go on side by side
    born, gone, recognised = (
        sum(info["learner"][what] for info in infos) for what in ("born", "gone", "recognised")
    )
    assert born.shape == (64,) and set((born - gone).tolist()) == {0, 1}
    assert (born - gone).sum() == last["learner"]["n_primitives"]
    assert recognised.sum() > 0 and (born[recognised > 0] > 0).all()
    performed = {info["primitive"] for info in infos} - {-1}
    assert len(performed) >= 3 and performed <= {id for info in infos[1:] for id in info["known"]}


def test_a_primitive_keeps_its_slot():
    env = make(warm_up_s=0.0)
    slots = {}
    env.reset(seed=0)
    for _ in range(60):
        env.step(0)
        for id, slot in env.unwrapped.repertoire.slots.items():
            assert slots.setdefault(id, slot) == slot
    assert len(slots) >= 4


def test_an_episode_depends_on_the_seed_alone():
    env = make()
    _, first = episode(env, 10, seed=1)
    episode(env, 3, seed=2)
    assert episode(env, 10, seed=1)[1] == first == episode(make(), 10, seed=1)[1]


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
@pytest.mark.parametrize(
    "demonstrator", [recording(2), "synthetic"], ids=["recording", "synthetic"]
)
def test_copies_go_on_bit_for_bit(copied, demonstrator):
    env = make(demonstrator=demonstrator, warm_up_s=3.0).unwrapped
    env.reset(seed=4)
    env.step(0)
    twin = copied(env)
    for _ in range(4):
        ours, theirs = env.step(0), twin.step(0)
        assert ours[1] == theirs[1] and told(ours[4]) == told(theirs[4])
    ours, theirs = env.learner.snapshot(), twin.learner.snapshot()
    assert ours.version == theirs.version


def test_what_was_learned_can_be_carried_over():
    env = make(carry_over=True, warm_up_s=40.0)
    infos, _ = episode(env, 5)
    known, frames = infos[-1]["learner"]["n_primitives"], env.unwrapped.learner.n_frames
    slots = dict(env.unwrapped.repertoire.slots)
    _, info = env.reset()
    assert info["learner"]["n_primitives"] >= known > 0
    assert info["learner"]["watched_s"] == 0.0  # it does not warm up again
    assert env.unwrapped.learner.n_frames >= frames
    assert {id: slot for id, slot in env.unwrapped.repertoire.slots.items() if id in slots} == {
        id: slot for id, slot in slots.items() if id in env.unwrapped.repertoire.slots
    }
    forgetful = make()
    episode(forgetful, 5)
    assert forgetful.reset()[1]["learner"]["watched_s"] == 20.0


def test_too_many_primitives_have_no_slot():
    env = make(actions={"capacity": 3}, warm_up_s=50.0)
    _, info = env.reset(seed=0)
    report = info["learner"]
    assert report["n_primitives"] - report["n_without_slot"] == 2
    assert env.unwrapped.repertoire.ids == tuple(sorted(env.unwrapped.library.ids)[:2])
    for _ in range(5):
        *_, info = env.step(env.action_space.sample(probability=info["transition_prior"]))


def test_what_will_be_known_is_what_is_known_then():
    env = make(warm_up_s=0.0).unwrapped
    env.reset(seed=0)
    coming, foreseen = env.ahead(), []
    for time_s, repertoire in coming:
        if time_s > 45.0:
            break
        ways = {id: repertoire.after(id).prior.tolist() for id in repertoire.ids}
        foreseen.append((time_s, repertoire.library.version, ways))
    assert len(foreseen) > 10 and env.learner.n_frames == 0  # it has not gone on itself
    time_s, kept = 0.0, set()
    while time_s < 44.0:
        time_s += env.step(0)[4]["duration_s"]
        version, ways = [each[1:] for each in foreseen if each[0] <= time_s + 1e-9][-1]
        kept.add(version)
        assert env.library.version == version
        mine = {id: env.repertoire.after(id).prior.tolist() for id in env.repertoire.ids}
        assert mine == ways
    assert len(kept) > 10
    for period_s in (0.0, -1.0, np.nan):
        with pytest.raises(InvalidValueError, match="period_s"):
            next(env.ahead(period_s))
    with pytest.raises(InvalidValueError, match="call reset first"):
        next(make().unwrapped.ahead())


def test_it_complies():
    check_env(make(warm_up_s=10.0).unwrapped, skip_render_check=True)
    assert check_action_mask(make(warm_up_s=20.0), steps=8).prior


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"demonstrator": "nobody"}, "'synthetic', a Recording or a LiveDemonstrator"),
        ({"warm_up_s": -1.0}, "warm_up_s"),
        ({"warm_up_s": np.nan}, "warm_up_s"),
        ({"task": "follow"}, "follow"),
        ({"actions": {"capacity": 1}}, "capacity"),
    ],
)
def test_bad_options_are_refused(options, message):
    with pytest.raises(InvalidValueError, match=message):
        make(**options)


def test_who_learns_its_library_is_given_none():
    with pytest.raises(InvalidValueError, match="learns its library"):
        make(library=standing_library())


def test_a_demonstrator_of_another_body_is_refused():
    odd = Recording(frames=np.zeros((50, 2)), rate_hz=50.0, channels=("a", "b"))
    with pytest.raises(LibraryError, match="not for this robot"):
        make(demonstrator=odd)


def test_streams_are_what_they_show():
    film = recording(1)
    stream = RecordingDemonstrator(film)
    stream.restart(np.random.default_rng(0))
    frames, ended = stream.take(10**6)
    assert ended and np.array_equal(frames, film.frames)
    assert np.array_equal(stream.take(3)[0], film.frames[:3])
    person = SyntheticDemonstrator()
    person.restart(np.random.default_rng(1))
    begun, _ = person.take(250)
    twin = copy.deepcopy(person)
    np.testing.assert_array_equal(person.take(100)[0], twin.take(100)[0])
    twin.restart(np.random.default_rng(1))
    np.testing.assert_array_equal(twin.take(250)[0], begun)


# ---- live libraries


def learner_after(rounds):
    film = recording(rounds)
    learner = MotionLearner(LearnerConfig(film.channels, film.rate_hz))
    learner.learn_many(film.frames)
    return learner


def test_a_live_environment_takes_a_snapshot_at_each_reset():
    learner = MotionLearner(LearnerConfig(humanoid().channels, RATE_HZ))
    env = gymnasium.make(GIVEN, library=learner, dynamics="kinematic", actions={"capacity": 32})
    _, info = env.reset(seed=0)
    assert info["action_mask"].sum() == 1 and info["dead_end"]
    assert not env.step(0)[4]["illegal"]
    learner.learn_many(recording(8).frames)
    *_, info = env.step(0)
    assert info["action_mask"].sum() == 1  # not within an episode
    _, info = env.reset()
    assert info["action_mask"].sum() > 1
    slots = dict(env.unwrapped.repertoire.slots)
    learner.learn_many(recording(4, seed=1).frames)
    _, info = env.reset()
    for id, slot in env.unwrapped.repertoire.slots.items():
        assert slots.get(id, slot) == slot
    assert info["library_version"] == learner.snapshot().version


def test_a_function_may_give_the_library():
    shelves = [standing_library(("squat", "rise")), standing_library(("squat", "rise", "wave"))]
    env = gymnasium.make(
        GIVEN,
        library=lambda: shelves[0],
        task=FreeTask(),
        actions={"capacity": 4},
        dynamics="kinematic",
    )
    env.reset()
    assert set(env.unwrapped.repertoire.slots.values()) == {1, 2}
    shelves.pop(0)
    env.reset()
    assert env.unwrapped.library is shelves[0]
    shelves[0] = standing_library()
    with pytest.raises(LibraryError, match="needs a capacity of at least"):
        env.reset()
    shelves[0] = 7
    with pytest.raises(LibraryError, match="returned a int"):
        env.reset()


def test_slots_are_reused_only_when_none_is_left():
    slots = Slots(4, 0)
    assert slots.update([10, 11]) == ()
    assert slots.update([11, 12]) == () and slots.of == {11: 2, 12: 3}
    assert slots.update([11, 13]) == () and slots.of == {11: 2, 13: 1}
    assert slots.update([11, 13, 14, 15]) == (15,) and slots.of[14] == 3


def test_each_episode_has_a_body_of_its_own():
    env = make(dynamics="simulated", body={"masses": 0.1}, warm_up_s=8.0)
    masses = []
    for seed in (1, 2, 1):
        env.reset(seed=seed)
        masses.append(env.unwrapped.model.body_mass.copy())
    nominal = humanoid().model().body_mass
    assert not np.allclose(masses[0], nominal) and not np.allclose(masses[0], masses[1])
    np.testing.assert_array_equal(masses[0], masses[2])
    with pytest.raises(InvalidValueError, match="and of no others: use dynamics='simulated'"):
        make(body={"masses": 0.1})
