"""Policies that begin where the demonstrator is: the prior as logits, or as what to stay near."""

from __future__ import annotations

from typing import Any

import torch
from sb3_contrib.common.maskable.policies import MaskableMultiInputActorCriticPolicy
from stable_baselines3.common.policies import MultiInputActorCriticPolicy
from torch import nn

from .config import PriorUse
from .encoding import capacity_of
from .features import blocks_of, log_prior
from .trunk import Trunk

SMALL = 0.01  # gain of layers that make logits, as Stable-Baselines3 has it


class _WithPrior:
    """Uses of the transition prior in an actor and critic, see `mplearn_agents.rl.config.PriorUse`.

    ``"logits"``: the untrained policy is the demonstrator's (nearly: the rest of the network starts
    small); training goes on from there. ``"feature"``: it waits as often as not. A hold is short,
    and to wait for somebody takes several: where all actions begin equally likely, it is hardly
    ever tried, and an agent settles for what it can do at once. ``"regulariser"``: the entropy
    bonus becomes the bonus -KL(policy || prior) = entropy + E[log prior], but for a constant.
    """

    def __init__(self, *args: Any, prior: PriorUse = "logits", **kwargs: Any) -> None:
        self.prior = prior
        super().__init__(*args, **kwargs)

    def _build_mlp_extractor(self: Any) -> None:
        n_speeds = int(self.action_space.n) // capacity_of(self.observation_space)
        blocks = blocks_of(self.observation_space)
        self.mlp_extractor = Trunk(
            self.net_arch, self.activation_fn, self.features_dim, blocks, self.prior, n_speeds
        )

    def _build(self, lr_schedule: Any) -> None:
        super()._build(lr_schedule)  # type: ignore[misc]
        net: nn.Linear = self.action_net  # type: ignore[attr-defined]
        n = net.out_features
        with torch.no_grad():
            net.weight[:, -2 * n : -n] = torch.eye(n)
            net.weight[:, -n:] = torch.eye(n)
            nn.init.orthogonal_(self.mlp_extractor.score.out.weight, SMALL)

    def evaluate_actions(
        self: Any, obs: Any, actions: torch.Tensor, **masks: Any
    ) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor | None]:
        """Return values, log-likelihoods and what the bonus is paid for, shape (N,) each."""
        values, log_prob, bonus = super().evaluate_actions(obs, actions, **masks)  # type: ignore[misc]
        if self.prior == "regulariser":
            probs = self.get_distribution(obs, **masks).distribution.probs
            capacity = capacity_of(self.observation_space)
            n_speeds = int(self.action_space.n) // capacity
            bonus = bonus + (probs * log_prior(obs, capacity).repeat(1, n_speeds)).sum(dim=1)
        return values, log_prob, bonus

    def _get_constructor_parameters(self) -> dict[str, Any]:
        known: dict[str, Any] = super()._get_constructor_parameters()  # type: ignore[misc]
        return known | {"prior": self.prior}


class MaskedPriorPolicy(_WithPrior, MaskableMultiInputActorCriticPolicy):  # type: ignore[misc]
    """Actor and critic for MaskablePPO, see `_WithPrior`."""


class PriorPolicy(_WithPrior, MultiInputActorCriticPolicy):  # type: ignore[misc]
    """Actor and critic for PPO, see `_WithPrior`."""
