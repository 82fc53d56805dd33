"""A small semi-Markov world on a graph, whose best returns can be computed exactly."""

import copy

import gymnasium
import numpy as np
from gymnasium import spaces

DISCOUNT = 0.8  # per second


class GraphWorld(gymnasium.Env):
    """Nodes 1 to n - 1 and hold; a step goes to a node, takes its time, and earns its reward.

    Args:
        edges: Where one can go from each node; from 0 at the start.
        duration_s: Of each node [s].
        reward: Of each node.
        ends: Nodes at which the episode ends.
        max_steps: Steps until truncation.
    """

    def __init__(self, edges, duration_s, reward, ends=(), max_steps=20):
        self.edges, self.duration_s, self.reward = edges, duration_s, reward
        self.ends, self.max_steps = ends, max_steps
        n = len(duration_s)
        self.action_space = spaces.Discrete(n)
        self.observation_space = spaces.Dict(
            {
                "action_mask": spaces.MultiBinary(n),
                "current_primitive": spaces.Discrete(n),
                "transition_prior": spaces.Box(0.0, 1.0, (n,), np.float64),
            }
        )

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.at, self.n_steps = 0, 0
        return self._observation(), self._info()

    def step(self, action):
        illegal = not self.action_masks()[action]
        duration_s, reward = (0.5, 0.0) if illegal or action == 0 else self.paid(action)
        if not illegal and action != 0:
            self.at = int(action)
        self.n_steps += 1
        info = self._info() | {
            "duration_s": duration_s,
            "discount": DISCOUNT**duration_s,
            "illegal": illegal,
            "fallen": False,
        }
        ended = self.at in self.ends
        return self._observation(), reward, ended, self.n_steps >= self.max_steps, info

    def paid(self, node):
        return self.duration_s[node], self.reward[node] * DISCOUNT ** self.duration_s[node]

    def action_masks(self):
        return self._info()["action_mask"].astype(bool)

    def state(self):
        return copy.copy((self.at, self.n_steps))

    def load_state(self, state):
        self.at, self.n_steps = state

    def _observation(self):
        info = self._info()
        return {
            "action_mask": info["action_mask"].copy(),
            "current_primitive": np.int64(self.at),
            "transition_prior": info["transition_prior"].copy(),
        }

    def _info(self):
        n = len(self.duration_s)
        mask, prior = np.zeros(n, np.int8), np.zeros(n)
        mask[[0, *self.edges[self.at]]] = 1
        prior[self.edges[self.at]] = 1.0 / len(self.edges[self.at])
        return {"action_mask": mask, "transition_prior": prior, "primitive": self.at or -1}


def two_ways():
    """One long step or three quick ones to the end: by time the three are better."""
    return GraphWorld(
        edges={0: [1, 2], 1: [5], 2: [3], 3: [4], 4: [5], 5: [1, 2]},
        duration_s=[0.5, 6.0, 0.3, 0.3, 0.3, 0.3],
        reward=[0.0, 0.0, 0.0, 0.0, 0.0, 1.0],
        ends=(5,),
    )
