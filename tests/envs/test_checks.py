"""The mask checker: it passes what is right, in any convention, and finds what is wrong."""

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from standing_library import standing_library

import mplearn_envs  # noqa: F401  (registers the environment)
from mplearn.errors import InvalidValueError
from mplearn_envs.checks import ActionMaskError, check_action_mask


def make(**options):
    options = {"library": standing_library(), "dynamics": "kinematic"} | options
    return gymnasium.make("mplearn/PrimitiveHumanoid-v0", **options)


def make_taxi():
    return gymnasium.make("Taxi-v4")


ENDLESS = np.random.default_rng(0)  # a source that no seed restarts


class Board(gymnasium.Env):
    """A game whose mask is in the observation alone, as in PettingZoo: each move once."""

    def __init__(self, keys=("observation", "action_mask")):
        self.action_space = spaces.Discrete(6)
        self.observation_space = spaces.Dict(
            {keys[0]: spaces.MultiBinary(6), keys[1]: spaces.Box(0, 1, (6,), np.int8)}
        )
        self.keys = keys

    def look(self):
        taken = self.taken.copy()
        return {self.keys[0]: taken, self.keys[1]: 1 - taken}

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.taken = np.zeros(6, np.int8)
        self.taken[self.np_random.integers(6)] = 1
        return self.look(), {}

    def step(self, action):
        if self.taken[action]:
            raise ValueError(f"{action} is taken")
        self.taken[action] = 1
        return self.look(), 0.0, bool(self.taken.sum() == 5), False, {}


def test_ours_passes():
    report = check_action_mask(make(), steps=60, illegal_share=0.2)
    assert report.illegal_tried > 3 and report.prior and report.flagged and 0 < report.legal < 1
    assert report.refused == 0
    assert check_action_mask(make(actions={"illegal": "raise"}), illegal_share=0.3).refused > 3
    assert check_action_mask(make(flat=True, task="follow")).prior
    assert check_action_mask(make(actions={"novel_penalty": 1.0})).legal > 0.3


def test_other_conventions_pass():
    taxi = check_action_mask(make_taxi())
    assert not taxi.prior and not taxi.flagged and taxi.illegal_tried > 0
    board = check_action_mask(Board(), illegal_share=0.3)
    assert board.refused == board.illegal_tried > 0


class Broken(gymnasium.Wrapper):
    """Passes everything on but for what ``spoil`` does to observation and info."""

    def __init__(self, env, spoil):
        super().__init__(env)
        self.spoil = spoil
        self.kept = np.ones(32, np.int8)

    def reset(self, **kwargs):
        observation, info = self.env.reset(**kwargs)
        self.spoil(self, observation, info)
        return observation, info

    def step(self, action):
        observation, *rest, info = self.env.step(action)
        self.spoil(self, observation, info)
        return observation, *rest, info


def _without(self, observation, info):
    del info["action_mask"]


def _as_bool(self, observation, info):
    info["action_mask"] = info["action_mask"].astype(bool)


def _too_long(self, observation, info):
    info["action_mask"] = np.append(info["action_mask"], np.int8(0))


def _twos(self, observation, info):
    info["action_mask"] *= 2


def _nothing_legal(self, observation, info):
    info["action_mask"][:] = 0


def _another(self, observation, info):
    info["action_mask"] = np.roll(info["action_mask"], 1)


def _leaky_prior(self, observation, info):
    info["transition_prior"] = np.full(32, 1 / 32)


def _unnormalised(self, observation, info):
    info["transition_prior"] *= 2


def _single_prior(self, observation, info):
    info["transition_prior"] = info["transition_prior"].astype(np.float32)


def _silent(self, observation, info):
    info["illegal"] = False


def _shared(self, observation, info):
    info["action_mask"] = observation["action_mask"]


def _reused(self, observation, info):
    self.kept[:] = info["action_mask"]
    info["action_mask"] = self.kept


def _random(self, observation, info):
    info["transition_prior"] = info["transition_prior"] ** ENDLESS.uniform(1, 2)
    info["transition_prior"] /= info["transition_prior"].sum()


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (_as_bool, "int8"),
        (_too_long, r"shape \(32,\)"),
        (_twos, "allowed are 0 and 1"),
        (_nothing_legal, "no action is legal"),
        (_another, "differs"),
        (_leaky_prior, "to illegal actions"),
        (_unnormalised, "sum to 1"),
        (_single_prior, "float64"),
        (_silent, r"info\['illegal'\]"),
        (_shared, "share memory|in the memory|differs"),
        (_reused, "in the memory|differs|changed"),
        (_random, "with the same seed"),
    ],
)
def test_it_finds(spoil, message):
    with pytest.raises(ActionMaskError, match=message):
        check_action_mask(Broken(make().unwrapped, spoil), steps=30, illegal_share=0.5)


def test_it_finds_that_there_is_no_mask():
    with pytest.raises(ActionMaskError, match="no mask"):
        check_action_mask(Broken(make_taxi().unwrapped, _without))


def test_it_finds_that_a_legal_action_is_refused():
    class Liar(Board):
        def look(self):
            seen = super().look()
            seen["action_mask"][:] = 1
            return seen

    with pytest.raises(ActionMaskError, match=r"is legal by the mask, and raised.*taken"):
        check_action_mask(Liar())


def test_it_asks_for_numbered_actions():
    with pytest.raises(ActionMaskError, match="Discrete"):
        check_action_mask(gymnasium.make("Pendulum-v1"))
    with pytest.raises(InvalidValueError, match="steps"):
        check_action_mask(make(), steps=0)
