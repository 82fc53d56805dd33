"""Takes a trained agent along when its library has grown: what it knew, it goes on knowing."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import gymnasium
import torch
from stable_baselines3.common.vec_env import DummyVecEnv
from torch import Tensor

from mplearn.errors import InvalidValueError

from .algorithms import new_model
from .encoding import capacity_of
from .features import features_of
from .trained import TrainedPolicy, courses_of, same_motion


def grow(agent: TrainedPolicy, env: gymnasium.Env[Any, Any]) -> TrainedPolicy:
    """Return an agent for an environment whose library has more primitives, or others.

    Primitives that the agent knew keep their weights, wherever their slots are now: where only they
    are legal it acts as before. A new primitive starts as in an untrained agent: by the prior. To
    train it further, give it to `train` as ``start``.

    Args:
        agent: An agent trained by "maskable-ppo" or "ppo".
        env: The environment to act in from now on; of the same task.

    Raises:
        InvalidValueError: The agent is of another kind, chooses among other speeds, or the
            environment's observation has other parts.
    """
    if agent.config.algorithm == "dqn":
        raise InvalidValueError("agents of maskable-ppo and ppo can grow, not of dqn")
    before = capacity_of(agent.model.observation_space)
    now = capacity_of(env.observation_space)  # type: ignore[arg-type]
    n_speeds = int(agent.model.action_space.n) // before
    if int(env.action_space.n) != n_speeds * now:  # type: ignore[attr-defined]
        raise InvalidValueError(
            f"the agent chooses among {n_speeds} speeds, here it would among "
            f"{int(env.action_space.n) // now}"  # type: ignore[attr-defined]
        )
    slots: dict[int, int] = dict(env.unwrapped.repertoire.slots)  # type: ignore[attr-defined]
    courses = courses_of(env)
    moved = {0: 0} | {
        agent.slots[id]: slots[id]
        for id in agent.slots
        if id in slots and same_motion(agent.courses.get(id, courses[id]), courses[id])
    }
    model = new_model(agent.config, DummyVecEnv([lambda: env]), agent.scaling)
    known: dict[str, Tensor] = agent.model.policy.state_dict()
    grown: dict[str, Tensor] = model.policy.state_dict()
    columns = _columns(agent.model, model, moved)
    actions = {s * before + a: s * now + b for s in range(n_speeds) for a, b in moved.items()}
    with torch.no_grad():
        for name, old in known.items():
            new = grown[name]
            if name.endswith(("policy_net.0.weight", "value_net.0.weight")):
                new[:, list(columns)] = old[:, list(columns.values())]
                n_common = old.shape[1] - _n_inputs(agent.model)
                new[:, -n_common:] = old[:, -n_common:]  # of blocks, whatever their slots
            elif name.startswith("action_net."):
                _copy_actions(old, new, actions)
            elif not name.startswith(("features_extractor.", "pi_features", "vf_features")):
                new.copy_(old)
    return TrainedPolicy(model, agent.config, slots, agent.deterministic, courses)


def _columns(old: Any, new: Any, moved: Mapping[int, int]) -> dict[int, int]:
    """Return for the features of the new model where they were in the old one, as far as known.

    The log prior is left out.
    """
    before = features_of(old.observation_space)[: _n_inputs(old)]
    after = features_of(new.observation_space)[: _n_inputs(new)]
    if {each.part for each in before} != {each.part for each in after}:
        raise InvalidValueError(
            f"the agent sees {sorted({each.part for each in before})}, the environment shows "
            f"{sorted({each.part for each in after})}"
        )
    now = {
        each._replace(slot=None if each.slot is None else moved[each.slot]): place
        for place, each in enumerate(before)
        if each.slot is None or each.slot in moved
    }
    return {place: now[each] for place, each in enumerate(after) if each in now}


def _n_inputs(model: Any) -> int:
    """Return the number of features but for the log prior."""
    return int(model.policy.features_dim) - capacity_of(model.observation_space)


def _copy_actions(old: Tensor, new: Tensor, moved: Mapping[int, int]) -> None:
    """Copy the rows of known actions; a matrix ends with two blocks of columns about slots."""
    there, here = torch.tensor(list(moved)), torch.tensor(list(moved.values()))
    if old.ndim == 1:
        new[here] = old[there]
        return
    hidden = old.shape[1] - 2 * old.shape[0]
    new[here, :hidden] = old[there, :hidden]
    new[here, hidden:] = 0.0  # what a known action makes of what is said of new ones
    for block in range(2):
        first, then = hidden + block * old.shape[0], hidden + block * new.shape[0]
        new[here[:, None], then + here] = old[there[:, None], first + there]
