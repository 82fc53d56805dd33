"""Policies that begin where the demonstrator is: the prior as logits, or as what to stay near."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import torch
from sb3_contrib.common.maskable.policies import MaskableMultiInputActorCriticPolicy
from stable_baselines3.common.policies import MultiInputActorCriticPolicy
from stable_baselines3.common.torch_layers import MlpExtractor
from torch import nn

from mplearn_envs.choices import HOLD

from .config import PriorUse
from .features import LARGEST, LEGAL, blocks_of, log_prior

SMALL = 0.01  # gain of layers that make logits, as Stable-Baselines3 has it


class Trunk(nn.Module):
    """Two multilayer perceptrons that see what blocks of slots have in common; scores of slots.

    What matters is often whether two blocks speak of the same slot (what was recognised is legal;
    the current primitive is the one asked for), whichever it is: so both perceptrons get, beside
    the features, the scalar product of each pair of the B blocks. And what the blocks say of a slot
    matters to the action of the same slot, whichever it is: so the actor has for each the score
    that one small network, the same for all, gives it, and its logit in the untrained policy.

    Args:
        net_arch: Widths of the perceptrons' layers.
        activation_fn: Between them.
        n_features: Number of features F, log prior included.
        blocks: Which features are about which slot, by part of the observation, B times A.
        prior: What the transition prior is to the untrained policy.
    """

    legal: torch.Tensor
    blocks: torch.Tensor
    one: torch.Tensor
    other: torch.Tensor

    def __init__(
        self,
        net_arch: list[int],
        activation_fn: type[nn.Module],
        n_features: int,
        blocks: Mapping[str, Sequence[int]],
        prior: PriorUse,
    ) -> None:
        super().__init__()
        self.prior = prior
        places = torch.tensor(list(blocks.values()))
        n_blocks, self.n_actions = places.shape
        one, other = torch.triu_indices(n_blocks, n_blocks, 1)
        n_inputs = n_features - self.n_actions + len(one)
        self.mlp = MlpExtractor(n_inputs, net_arch, activation_fn, "cpu")
        self.score = SlotScore(n_blocks + 1, self.mlp.latent_dim_pi)
        self.register_buffer("legal", torch.tensor(blocks[LEGAL]), persistent=False)
        self.register_buffer("blocks", places, persistent=False)
        self.register_buffer("one", places[one], persistent=False)
        self.register_buffer("other", places[other], persistent=False)
        self.latent_dim_pi = self.mlp.latent_dim_pi + 2 * self.n_actions
        self.latent_dim_vf = self.mlp.latent_dim_vf

    def forward(self, features: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Return what actor and critic make of the features."""
        return self.forward_actor(features), self.forward_critic(features)

    def forward_actor(self, features: torch.Tensor) -> torch.Tensor:
        """Return the actor's latent, shape (N, H + 2 A)."""
        latent = self.mlp.forward_actor(self._inputs(features))
        log_prior = features[:, -self.n_actions :]
        said = torch.cat((features[:, self.blocks], log_prior[:, None] / LARGEST), dim=1)
        return torch.cat((latent, self.score(said, latent), self._untrained(features)), dim=1)

    def forward_critic(self, features: torch.Tensor) -> torch.Tensor:
        """Return the critic's latent, shape (N, H)."""
        return self.mlp.forward_critic(self._inputs(features))

    def _untrained(self, features: torch.Tensor) -> torch.Tensor:
        """Return the logits of the untrained policy, shape (N, A)."""
        if self.prior == "logits":
            return features[:, -self.n_actions :]
        logits = torch.zeros_like(features[:, self.legal])
        if self.prior == "feature":
            others = features[:, self.legal].sum(dim=1) - 1.0
            logits[:, HOLD] = torch.log(torch.clamp(others, min=1.0))
        return logits

    def _inputs(self, features: torch.Tensor) -> torch.Tensor:
        common = (features[:, self.one] * features[:, self.other]).sum(dim=2)
        return torch.cat((features[:, : -self.n_actions], common), dim=1)


class SlotScore(nn.Module):
    """A score of each slot by what is said of it, in the light of everything else.

    A slot of which nothing is said, as of one that is free, has score 0.

    Args:
        n_blocks: Number of blocks B that say something of slots.
        n_latent: Number of numbers H that say everything else.
        width: Of the hidden layer.
    """

    def __init__(self, n_blocks: int, n_latent: int, width: int = 32) -> None:
        super().__init__()
        self.said = nn.Linear(n_blocks, width, bias=False)
        self.context = nn.Linear(n_latent, width)
        self.out = nn.Linear(width, 1, bias=False)

    def forward(self, said: torch.Tensor, latent: torch.Tensor) -> torch.Tensor:
        """Return the scores, shape (N, A), of what is said (N, B, A) in a context (N, H)."""
        context = self.context(latent)[:, None]
        hidden = torch.tanh(self.said(said.transpose(1, 2)) + context) - torch.tanh(context)
        scores: torch.Tensor = self.out(hidden).squeeze(2)
        return scores


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
        n_actions = int(self.action_space.n)
        blocks = blocks_of(self.observation_space, n_actions)
        self.mlp_extractor = Trunk(
            self.net_arch, self.activation_fn, self.features_dim, blocks, self.prior
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
            bonus = bonus + (probs * log_prior(obs)).sum(dim=1)
        return values, log_prob, bonus

    def _get_constructor_parameters(self) -> dict[str, Any]:
        known: dict[str, Any] = super()._get_constructor_parameters()  # type: ignore[misc]
        return known | {"prior": self.prior}


class MaskedPriorPolicy(_WithPrior, MaskableMultiInputActorCriticPolicy):  # type: ignore[misc]
    """Actor and critic for MaskablePPO, see `_WithPrior`."""


class PriorPolicy(_WithPrior, MultiInputActorCriticPolicy):  # type: ignore[misc]
    """Actor and critic for PPO, see `_WithPrior`."""
