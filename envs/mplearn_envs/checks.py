"""Whether an environment's action mask keeps its promises: run it on your own environment."""

from __future__ import annotations

import copy
import pickle
from typing import Any, NamedTuple

import gymnasium
import numpy as np

from mplearn.errors import InvalidValueError, MPLearnError
from mplearn.recording import FloatArray

Array = np.ndarray[Any, Any]
Env = gymnasium.Env[Any, Any]


class ActionMaskError(MPLearnError, AssertionError):
    """An environment's action mask breaks the convention.

    Example:
        >>> import gymnasium as gym
        >>> try:
        ...     check_action_mask(gym.make("CartPole-v1"), steps=2)
        ... except ActionMaskError as error:
        ...     print(str(error)[:34])
        before step 0: there is no mask: n
    """


class MaskReport(NamedTuple):
    """What was seen while checking.

    Attributes:
        steps: Number of steps made.
        legal: Mean share of legal actions.
        illegal_tried: How many illegal actions were tried.
        flagged: Whether ``info["illegal"]`` tells of illegal actions.
        refused: How many of those tried raised an error.
        prior: Whether the environment gives a transition prior.

    Example:
        >>> import gymnasium as gym
        >>> class Doors(gym.Env):
        ...     action_space, observation_space = gym.spaces.Discrete(3), gym.spaces.Discrete(1)
        ...
        ...     def reset(self, *, seed=None, options=None):
        ...         super().reset(seed=seed)
        ...         return 0, {"action_mask": np.array([1, 0, 1], np.int8)}
        ...
        ...     def step(self, action):
        ...         return 0, 0.0, False, False, {"action_mask": np.array([1, 0, 1], np.int8)}
        >>> report = check_action_mask(Doors(), steps=20)
        >>> report.steps, report.prior, round(report.legal, 3)
        (20, False, 0.667)
    """

    steps: int
    legal: float
    illegal_tried: int
    flagged: bool
    refused: int
    prior: bool


def check_action_mask(
    env: Env, steps: int = 50, seed: int = 0, illegal_share: float = 0.1
) -> MaskReport:
    """Check that an environment's action mask can be relied on.

    * The action space is ``Discrete(n)`` from 0. `reset` and `step` both give the mask: as
      ``info["action_mask"]`` (Taxi's convention), ``observation["action_mask"]`` (PettingZoo's) or
      ``env.unwrapped.action_masks()`` (sb3-contrib's); where there are several, they are equal.
    * The mask has shape (n,), values 0 and 1, and at least one 1. Its dtype is int8, which
      ``Discrete.sample(mask)`` takes; that of ``action_masks()`` may also be bool.
    * Arrays are fresh: later steps do not change what was returned, no two places share memory, and
      what a user writes into them does not reach the environment.
    * `step` agrees: no legal action raises an error; where ``info["illegal"]`` is given, it says of
      each action what the mask said. Illegal actions may raise an error.
    * ``info["transition_prior"]``, if given, is float64, at least 0, sums to 1, is 0 where the mask
      is, and is fresh too.
    * The same seed gives the same masks and priors. They survive pickling (where the environment
      can be pickled), copying, and ``SyncVectorEnv``.

    Args:
        env: The environment; it is reset and stepped, and not closed.
        steps: How many steps to make.
        seed: Of the episodes and of the actions.
        illegal_share: How often an illegal action is tried, if there is one.

    Raises:
        ActionMaskError: Something does not hold; the message says what, and where.

    Example:
        >>> import gymnasium as gym
        >>> class Doors(gym.Env):
        ...     action_space, observation_space = gym.spaces.Discrete(3), gym.spaces.Discrete(1)
        ...
        ...     def reset(self, *, seed=None, options=None):
        ...         super().reset(seed=seed)
        ...         return 0, {"action_mask": np.array([1, 0, 1], np.int8)}
        ...
        ...     def step(self, action):
        ...         return 0, 0.0, False, False, {"action_mask": np.array([1, 0, 1], np.int8)}
        >>> check_action_mask(Doors(), steps=20).refused  # no action raises an error
        0
    """
    space = env.action_space
    if not isinstance(space, gymnasium.spaces.Discrete) or space.start != 0:
        raise ActionMaskError(f"masked environments have actions Discrete(n) from 0, not {space}")
    if steps < 1 or not 0.0 <= illegal_share <= 1.0:
        raise InvalidValueError(
            f"steps must be at least 1 and illegal_share in [0, 1], not {steps}, {illegal_share}"
        )
    walk = _walk(env, steps, seed, illegal_share)
    again = _walk(env, steps, seed, illegal_share)
    for step, (a, b) in enumerate(zip(walk.seen, again.seen, strict=True)):
        if not a.equals(b):
            raise ActionMaskError(f"with the same seed the mask or prior of step {step} differs")
    _check_copies(env, seed)
    _check_vectorising(env, seed)
    share = float(np.mean([seen.mask.mean() for seen in walk.seen]))
    has_prior = walk.seen[0].prior is not None
    return MaskReport(steps, share, walk.illegal_tried, walk.flagged, walk.refused, has_prior)


class _Seen(NamedTuple):
    """Mask and prior at one moment, copied."""

    mask: Array
    prior: FloatArray | None

    def equals(self, other: _Seen) -> bool:
        same = np.array_equal(self.mask, other.mask)
        if self.prior is None or other.prior is None:
            return same and self.prior is other.prior
        return same and np.array_equal(self.prior, other.prior)


class _Walk(NamedTuple):
    seen: list[_Seen]
    illegal_tried: int
    flagged: bool
    refused: int


def _walk(env: Env, steps: int, seed: int, illegal_share: float) -> _Walk:
    rng = np.random.default_rng(seed)
    observation, info = env.reset(seed=seed)
    walked, tried, flagged, refused = [], 0, False, 0
    for step in range(steps):
        seen = _look(env, observation, info, f"before step {step}")
        walked.append(seen)
        illegal = np.flatnonzero(seen.mask == 0)
        try_illegal = len(illegal) > 0 and rng.random() < illegal_share
        action = int(rng.choice(illegal if try_illegal else np.flatnonzero(seen.mask)))
        tried += int(try_illegal)
        kept = _returned(observation, info)
        for array, _ in kept:
            array[...] = 1 - array  # what a user writes must not reach the environment
        written = [array.copy() for array, _ in kept]
        try:
            observation, _, terminated, truncated, info = env.step(np.int64(action))
        except Exception as error:
            if not try_illegal:
                raise ActionMaskError(
                    f"step {step}: action {action} is legal by the mask, and raised {error!r}"
                ) from error
            refused += 1
            terminated = True
        else:
            _require_fresh(kept, written, _returned(observation, info), step)
            flagged |= "illegal" in info
            if "illegal" in info and bool(info["illegal"]) != try_illegal:
                raise ActionMaskError(
                    f"step {step}: action {action} was {'il' * try_illegal}legal by the mask, and "
                    f"info['illegal'] is {info['illegal']}"
                )
        if terminated or truncated:
            observation, info = env.reset()
    return _Walk(walked, tried, flagged, refused)


def _returned(observation: Any, info: dict[str, Any]) -> list[tuple[Array, str]]:
    """Return the arrays that belong to the user from now on, and what to call them."""
    found = [(info[key], f"info[{key!r}]") for key in ("action_mask", "transition_prior")
             if isinstance(info.get(key), np.ndarray)]  # fmt: skip
    if isinstance(observation, dict):
        found += [
            (observation[key], f"observation[{key!r}]")
            for key in ("action_mask", "transition_prior")
            if isinstance(observation.get(key), np.ndarray)
        ]
    return found


def _require_fresh(
    before: list[tuple[Array, str]],
    written: list[Array],
    after: list[tuple[Array, str]],
    step: int,
) -> None:
    for (array, name), held in zip(before, written, strict=True):
        if not np.array_equal(array, held):
            raise ActionMaskError(f"step {step} changed {name} that was returned before")
        for other, other_name in after:
            if np.shares_memory(array, other):
                raise ActionMaskError(
                    f"step {step} returned {other_name} in the memory of the earlier {name}, "
                    "not a fresh array"
                )
    for k, (array, name) in enumerate(after):
        for other, other_name in after[k + 1 :]:
            if np.shares_memory(array, other):
                raise ActionMaskError(f"after step {step} {name} and {other_name} share memory")


def _look(env: Env, observation: Any, info: dict[str, Any], where: str) -> _Seen:
    """Return mask and prior, both checked."""
    n = int(env.action_space.n)  # type: ignore[attr-defined]
    masks: dict[str, Any] = {}
    if "action_mask" in info:
        masks["info['action_mask']"] = info["action_mask"]
    if isinstance(observation, dict) and "action_mask" in observation:
        masks["observation['action_mask']"] = observation["action_mask"]
    method = getattr(env.unwrapped, "action_masks", None)
    if callable(method):
        mask = np.asarray(method())
        masks["action_masks()"] = mask.astype(np.int8) if mask.dtype == np.bool_ else mask
    if not masks:
        raise ActionMaskError(
            f"{where}: there is no mask: no 'action_mask' in info, which has {sorted(info)}, nor "
            "in the observation, and no method action_masks()"
        )
    for name, mask in masks.items():
        _require_mask(mask, n, f"{where}: {name}")
    first_name, first = next(iter(masks.items()))
    for name, mask in masks.items():
        if not np.array_equal(mask, first):
            raise ActionMaskError(f"{where}: {name} differs from {first_name}")
    prior = info.get("transition_prior")
    if prior is not None:
        _require_prior(prior, first, where)
    return _Seen(np.array(first), None if prior is None else prior.copy())


def _require_mask(mask: Any, n: int, where: str) -> None:
    if not isinstance(mask, np.ndarray) or mask.shape != (n,) or mask.dtype != np.int8:
        raise ActionMaskError(
            f"{where} must be an int8 array of shape ({n},), not "
            f"{getattr(mask, 'dtype', type(mask).__name__)} of {getattr(mask, 'shape', '?')}"
        )
    if not np.isin(mask, (0, 1)).all():
        raise ActionMaskError(f"{where} holds {np.unique(mask)}, allowed are 0 and 1")
    if not mask.any():
        raise ActionMaskError(f"{where}: no action is legal; gymnasium would silently sample 0")


def _require_prior(prior: Any, mask: Array, where: str) -> None:
    if not isinstance(prior, np.ndarray) or prior.shape != mask.shape or prior.dtype != np.float64:
        raise ActionMaskError(f"{where}: the prior must be a float64 array of shape {mask.shape}")
    if not (np.isfinite(prior).all() and (prior >= 0).all() and abs(prior.sum() - 1.0) < 1e-8):
        raise ActionMaskError(f"{where}: the prior must be >= 0 and sum to 1, not {prior.sum()}")
    if prior[mask == 0].any():
        raise ActionMaskError(
            f"{where}: the prior gives {prior[mask == 0].sum():.3g} to illegal actions"
        )


def _check_copies(env: Env, seed: int) -> None:
    """Check that copies go on like the environment itself."""
    observation, info = env.reset(seed=seed)
    seen = _look(env, observation, info, "after reset")
    action = np.int64(np.flatnonzero(seen.mask)[-1])
    twins = {"a deep copy": copy.deepcopy(env)}
    packed = _pickled(env)
    if packed is not None:
        twins["a pickled copy"] = pickle.loads(packed)
    observation, _, _, _, info = env.step(action)
    ours = _look(env, observation, info, "after a step")
    for name, twin in twins.items():
        observation, _, _, _, info = twin.step(action)
        if not ours.equals(_look(twin, observation, info, f"{name} after a step")):
            raise ActionMaskError(f"{name} gives another mask or prior after the same action")
        twin.close()


def _check_vectorising(env: Env, seed: int) -> None:
    """Check that a vector environment gives the masks of a single one."""
    vector = gymnasium.vector.SyncVectorEnv([lambda: copy.deepcopy(env)] * 2)
    _, info = env.reset(seed=seed)
    _, infos = vector.reset(seed=[seed, seed])
    for step in range(3):
        if "action_mask" not in info:
            break
        for row in infos["action_mask"]:
            if not np.array_equal(row, info["action_mask"]):
                raise ActionMaskError(
                    f"a vector environment gives another mask than a single one at step {step}"
                )
        action = np.int64(np.flatnonzero(info["action_mask"])[-1])
        _, _, terminated, truncated, info = env.step(action)
        *_, infos = vector.step(np.array([action, action]))
        if terminated or truncated:
            break
    vector.close()


def _pickled(env: Env) -> bytes | None:
    try:
        return pickle.dumps(env)
    except (pickle.PicklingError, TypeError, AttributeError):
        return None
