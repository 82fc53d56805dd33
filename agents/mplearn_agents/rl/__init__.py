"""Reinforcement learning over a primitive graph, with masks, priors and macro steps.

`train.train` trains. It needs the extra ``rl`` (Stable-Baselines3, sb3-contrib, torch); `rllib`
needs ``cluster``, and `offline` needs ``offline``. Modules that import one of these are themselves
imported where they are used.
"""

from .config import TrainingConfig as TrainingConfig
from .projection import ProjectIllegal as ProjectIllegal
from .trained import TrainedPolicy as TrainedPolicy
