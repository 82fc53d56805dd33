"""Whether an environment's action mask keeps its promises: run it on your own environment."""

from __future__ import annotations

import pickle
from typing import Any, NamedTuple

import gymnasium
import numpy as np

from mplearn.errors import MPLearnError


class ActionMaskError(MPLearnError, AssertionError):
    """An environment's action mask breaks the convention."""


class MaskReport(NamedTuple):
    """What was seen while checking.

    Attributes:
        steps: Number of steps made.
        legal: Mean share of legal actions.
        illegal_tried: How many illegal actions were tried.
        prior: Whether the environment gives a transition prior.
    """

    steps: int
    legal: float
    illegal_tried: int
    prior: bool


def check_action_mask(
    env: gymnasium.Env[Any, Any], steps: int = 50, seed: int = 0, illegal_share: float = 0.1
) -> MaskReport:
    """Check the convention of ``info["action_mask"]`` (and ``info["transition_prior"]``, if given).

    * The action space is ``Discrete(n)`` from 0; `reset` and `step` both return the mask in
    ``info``.
    * The mask has shape (n,), dtype int8 (what ``Discrete.sample(mask)`` takes), values 0 and 1,
    and
      at least one 1. It equals ``env.unwrapped.action_masks()`` and ``observation["action_mask"]``
      where there are such.
    * Arrays are fresh: later steps do not change what was returned, nor does the environment depend
      on what its user writes into them.
    * Where ``info["illegal"]`` is given, it says for each action what the mask said.
    * The prior is float64, at least 0, sums to 1, and is 0 where the mask is.
    * The same seed gives the same masks; they survive pickling and ``SyncVectorEnv``.

    Args:
        env: The environment; it is reset and stepped, and not closed.
        steps: How many steps to make.
        seed: Of the episodes and of the actions.
        illegal_share: How often an illegal action is tried, if there is one.

    Raises:
        ActionMaskError: Something does not hold; the message says what, and where.
    """
    space = env.action_space
    if not isinstance(space, gymnasium.spaces.Discrete) or space.start != 0:
        raise ActionMaskError(f"masked environments have actions Discrete(n) from 0, not {space}")
    rng = np.random.default_rng(seed)
    first = _walk(env, space, steps, seed, rng, illegal_share)
    again = _walk(env, space, steps, seed, np.random.default_rng(seed), illegal_share)
    for step, (a, b) in enumerate(zip(first.masks, again.masks, strict=True)):
        if not np.array_equal(a, b):
            raise ActionMaskError(f"with the same seed the mask of step {step} differs")
    _check_pickling(env, space, seed)
    _check_vectorising(env, space, seed)
    shares = [float(np.mean(mask)) for mask in first.masks]
    return MaskReport(steps, float(np.mean(shares)), first.illegal_tried, first.prior)


class _Walk(NamedTuple):
    masks: list[np.ndarray[Any, Any]]
    illegal_tried: int
    prior: bool


def _walk(
    env: gymnasium.Env[Any, Any],
    space: gymnasium.spaces.Discrete,
    steps: int,
    seed: int,
    rng: np.random.Generator,
    illegal_share: float,
) -> _Walk:
    observation, info = env.reset(seed=seed)
    masks, tried, has_prior = [], 0, "transition_prior" in info
    for step in range(steps):
        where = f"before step {step}"
        mask = _checked_mask(env, space, observation, info, where)
        if has_prior:
            _check_prior(info, mask, where)
        masks.append(mask.copy())
        illegal = np.flatnonzero(mask == 0)
        try_illegal = len(illegal) > 0 and rng.random() < illegal_share
        action = rng.choice(illegal if try_illegal else np.flatnonzero(mask))
        tried += int(try_illegal)
        kept, held = info["action_mask"], info["action_mask"].copy()
        observation, _, terminated, truncated, info = env.step(space.dtype.type(action))
        if not np.array_equal(kept, held):
            raise ActionMaskError(f"step {step} changed the mask that was returned before")
        if np.shares_memory(kept, info.get("action_mask", held)):
            raise ActionMaskError(f"step {step} returned the same array as before, not a fresh one")
        kept[:] = 1 - kept  # what a user writes must not reach the environment
        if "illegal" in info and bool(info["illegal"]) != try_illegal:
            raise ActionMaskError(
                f"step {step}: action {action} was {'il' * try_illegal}legal by the mask, and "
                f"info['illegal'] is {info['illegal']}"
            )
        if terminated or truncated:
            observation, info = env.reset()
    return _Walk(masks, tried, has_prior)


def _checked_mask(
    env: gymnasium.Env[Any, Any],
    space: gymnasium.spaces.Discrete,
    observation: Any,
    info: dict[str, Any],
    where: str,
) -> np.ndarray[Any, Any]:
    if "action_mask" not in info:
        raise ActionMaskError(f"{where}: info has no 'action_mask'; it has {sorted(info)}")
    mask = info["action_mask"]
    if not isinstance(mask, np.ndarray) or mask.shape != (space.n,) or mask.dtype != np.int8:
        raise ActionMaskError(
            f"{where}: the mask must be an int8 array of shape ({space.n},), not "
            f"{getattr(mask, 'dtype', type(mask).__name__)} of {getattr(mask, 'shape', '?')}"
        )
    if not np.isin(mask, (0, 1)).all():
        raise ActionMaskError(f"{where}: the mask holds {np.unique(mask)}, allowed are 0 and 1")
    if not mask.any():
        raise ActionMaskError(f"{where}: no action is legal; gymnasium would silently sample 0")
    method = getattr(env.unwrapped, "action_masks", None)
    if method is not None and not np.array_equal(np.asarray(method(), dtype=np.int8), mask):
        raise ActionMaskError(f"{where}: action_masks() differs from info['action_mask']")
    if isinstance(observation, dict) and "action_mask" in observation:
        if not np.array_equal(observation["action_mask"], mask):
            raise ActionMaskError(f"{where}: the observation's mask differs from info's")
        if np.shares_memory(observation["action_mask"], mask):
            raise ActionMaskError(f"{where}: observation and info share the mask's memory")
    return mask


def _check_prior(info: dict[str, Any], mask: np.ndarray[Any, Any], where: str) -> None:
    prior = info.get("transition_prior")
    if not isinstance(prior, np.ndarray) or prior.shape != mask.shape or prior.dtype != np.float64:
        raise ActionMaskError(f"{where}: the prior must be a float64 array of shape {mask.shape}")
    if not (np.isfinite(prior).all() and (prior >= 0).all() and abs(prior.sum() - 1.0) < 1e-8):
        raise ActionMaskError(f"{where}: the prior must be >= 0 and sum to 1, not {prior.sum()}")
    if prior[mask == 0].any():
        raise ActionMaskError(
            f"{where}: the prior gives {prior[mask == 0].sum():.3g} to illegal actions"
        )


def _check_pickling(
    env: gymnasium.Env[Any, Any], space: gymnasium.spaces.Discrete, seed: int
) -> None:
    _, info = env.reset(seed=seed)
    twin = pickle.loads(pickle.dumps(env.unwrapped))
    action = space.dtype.type(np.flatnonzero(info["action_mask"])[-1])
    ours, theirs = env.step(action)[-1], twin.step(action)[-1]
    twin.close()
    if not np.array_equal(ours["action_mask"], theirs["action_mask"]):
        raise ActionMaskError("a pickled copy gives another mask after the same action")


def _check_vectorising(
    env: gymnasium.Env[Any, Any], space: gymnasium.spaces.Discrete, seed: int
) -> None:
    packed = pickle.dumps(env.unwrapped)
    vector = gymnasium.vector.SyncVectorEnv([lambda: pickle.loads(packed)] * 2)
    _, info = env.reset(seed=seed)
    _, infos = vector.reset(seed=[seed, seed])
    vector.close()
    for row in infos["action_mask"]:
        if not np.array_equal(row, info["action_mask"]):
            raise ActionMaskError("a vector environment gives another mask than a single one")
