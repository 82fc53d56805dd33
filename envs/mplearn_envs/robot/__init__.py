"""Robots: the humanoid of the experiments, and the description through which others come in."""

from .description import BASE_CHANNELS as BASE_CHANNELS
from .description import JointGroup as JointGroup
from .description import Robot as Robot
from .humanoid import humanoid as humanoid
