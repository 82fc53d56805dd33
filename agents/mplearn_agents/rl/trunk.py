"""What is between features and actions: perceptrons, and one small network that scores slots."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import torch
from stable_baselines3.common.torch_layers import MlpExtractor
from torch import nn

from mplearn_envs.skills.action_choices import HOLD

from .config import PriorUse
from .features import LARGEST, LEGAL


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
        n_speeds: Number of speeds, each with an action for each of the A slots: to the untrained
            policy all of them are alike.
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
        n_speeds: int = 1,
    ) -> None:
        super().__init__()
        self.prior, self.n_speeds = prior, n_speeds
        places = torch.tensor(list(blocks.values()))
        n_blocks, self.n_slots = places.shape
        one, other = torch.triu_indices(n_blocks, n_blocks, 1)
        n_inputs = n_features - self.n_slots + len(one)
        self.mlp = MlpExtractor(n_inputs, net_arch, activation_fn, "cpu")
        self.score = SlotScore(n_blocks + 1, self.mlp.latent_dim_pi, n_speeds)
        self.register_buffer("legal", torch.tensor(blocks[LEGAL]), persistent=False)
        self.register_buffer("blocks", places, persistent=False)
        self.register_buffer("one", places[one], persistent=False)
        self.register_buffer("other", places[other], persistent=False)
        self.latent_dim_pi = self.mlp.latent_dim_pi + 2 * n_speeds * self.n_slots
        self.latent_dim_vf = self.mlp.latent_dim_vf

    def forward(self, features: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Return what actor and critic make of the features."""
        return self.forward_actor(features), self.forward_critic(features)

    def forward_actor(self, features: torch.Tensor) -> torch.Tensor:
        """Return the actor's latent, shape (N, H + 2 A S) for S speeds."""
        latent = self.mlp.forward_actor(self._inputs(features))
        log_prior = features[:, -self.n_slots :]
        said = torch.cat((features[:, self.blocks], log_prior[:, None] / LARGEST), dim=1)
        untrained = self._untrained(features).repeat(1, self.n_speeds)
        return torch.cat((latent, self.score(said, latent), untrained), dim=1)

    def forward_critic(self, features: torch.Tensor) -> torch.Tensor:
        """Return the critic's latent, shape (N, H)."""
        return self.mlp.forward_critic(self._inputs(features))

    def _untrained(self, features: torch.Tensor) -> torch.Tensor:
        """Return the logits of the untrained policy at any speed, shape (N, A)."""
        if self.prior == "logits":
            return features[:, -self.n_slots :]
        logits = torch.zeros_like(features[:, self.legal])
        if self.prior == "feature":
            others = features[:, self.legal].sum(dim=1) - 1.0
            logits[:, HOLD] = torch.log(torch.clamp(others, min=1.0))
        return logits

    def _inputs(self, features: torch.Tensor) -> torch.Tensor:
        common = (features[:, self.one] * features[:, self.other]).sum(dim=2)
        return torch.cat((features[:, : -self.n_slots], common), dim=1)


class SlotScore(nn.Module):
    """A score of each slot by what is said of it, in the light of everything else.

    A slot of which nothing is said, as of one that is free, has score 0.

    Args:
        n_blocks: Number of blocks B that say something of slots.
        n_latent: Number of numbers H that say everything else.
        n_speeds: Number of speeds S, at each of which a slot has a score.
        width: Of the hidden layer.
    """

    def __init__(self, n_blocks: int, n_latent: int, n_speeds: int, width: int = 32) -> None:
        super().__init__()
        self.said = nn.Linear(n_blocks, width, bias=False)
        self.context = nn.Linear(n_latent, width)
        self.out = nn.Linear(width, n_speeds, bias=False)

    def forward(self, said: torch.Tensor, latent: torch.Tensor) -> torch.Tensor:
        """Return the scores, shape (N, S A), of what is said (N, B, A) in a context (N, H)."""
        context = self.context(latent)[:, None]
        hidden = torch.tanh(self.said(said.transpose(1, 2)) + context) - torch.tanh(context)
        scores: torch.Tensor = self.out(hidden).transpose(1, 2).flatten(1)
        return scores
