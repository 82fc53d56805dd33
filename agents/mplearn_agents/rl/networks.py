"""Policies that begin where the demonstrator is: the prior as logits, or as what to stay near."""

from __future__ import annotations

from typing import Any

import torch
from sb3_contrib.common.maskable.policies import MaskableMultiInputActorCriticPolicy
from stable_baselines3.common.policies import MultiInputActorCriticPolicy
from stable_baselines3.common.torch_layers import MlpExtractor
from torch import nn

from .config import PriorUse
from .features import log_prior


class Trunk(nn.Module):
    """Two multilayer perceptrons; the actor's keeps the logarithm of the prior beside its output.

    Args:
        mlp: The perceptrons, over all features but the log prior.
        n_actions: Number of actions A.
    """

    def __init__(self, mlp: MlpExtractor, n_actions: int) -> None:
        super().__init__()
        self.mlp = mlp
        self.n_actions = n_actions
        self.latent_dim_pi = mlp.latent_dim_pi + n_actions
        self.latent_dim_vf = mlp.latent_dim_vf

    def forward(self, features: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Return what actor and critic make of the features."""
        return self.forward_actor(features), self.forward_critic(features)

    def forward_actor(self, features: torch.Tensor) -> torch.Tensor:
        """Return the actor's latent, shape (N, H + A)."""
        prior = features[:, -self.n_actions :]
        return torch.cat((self.mlp.forward_actor(features[:, : -self.n_actions]), prior), dim=1)

    def forward_critic(self, features: torch.Tensor) -> torch.Tensor:
        """Return the critic's latent, shape (N, H)."""
        return self.mlp.forward_critic(features[:, : -self.n_actions])


class _WithPrior:
    """Uses of the transition prior in an actor and critic, see `mplearn_agents.rl.config.PriorUse`.

    ``"logits"``: the untrained policy is the demonstrator's (nearly: the rest of the network starts
    small); training goes on from there. ``"regulariser"``: the entropy bonus becomes the bonus
    -KL(policy || prior) = entropy + E[log prior], but for a constant.
    """

    def __init__(self, *args: Any, prior: PriorUse = "logits", **kwargs: Any) -> None:
        self.prior = prior
        super().__init__(*args, **kwargs)

    def _build_mlp_extractor(self: Any) -> None:
        n_actions = int(self.action_space.n)
        mlp = MlpExtractor(
            self.features_dim - n_actions,
            net_arch=self.net_arch,
            activation_fn=self.activation_fn,
            device=self.device,
        )
        self.mlp_extractor = Trunk(mlp, n_actions)

    def _build(self, lr_schedule: Any) -> None:
        super()._build(lr_schedule)  # type: ignore[misc]
        net: nn.Linear = self.action_net  # type: ignore[attr-defined]
        n = net.out_features
        with torch.no_grad():
            net.weight[:, -n:] = torch.eye(n) if self.prior == "logits" else 0.0

    def evaluate_actions(
        self: Any, obs: Any, actions: torch.Tensor, **masks: Any
    ) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor | None]:
        """Return values, log-likelihoods and what the bonus is paid for, shape (N,) each."""
        values, log_prob, bonus = super().evaluate_actions(obs, actions, **masks)  # type: ignore[misc]
        if self.prior == "regulariser":
            probs = self.get_distribution(obs, **masks).distribution.probs
            bonus = bonus + (probs * log_prior(obs)).sum(dim=1)
        return values, log_prob, bonus

    def _get_constructor_parameters(self) -> dict[str, Any]:
        known: dict[str, Any] = super()._get_constructor_parameters()  # type: ignore[misc]
        return known | {"prior": self.prior}


class MaskedPriorPolicy(_WithPrior, MaskableMultiInputActorCriticPolicy):  # type: ignore[misc]
    """Actor and critic for MaskablePPO, see `_WithPrior`."""


class PriorPolicy(_WithPrior, MultiInputActorCriticPolicy):  # type: ignore[misc]
    """Actor and critic for PPO, see `_WithPrior`."""
