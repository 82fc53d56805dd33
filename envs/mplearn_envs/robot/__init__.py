"""Robots: the humanoid of the experiments, and the description through which others come in."""

from .description import BASE_CHANNELS as BASE_CHANNELS
from .description import NEEDED_ROLES as NEEDED_ROLES
from .description import ROLES as ROLES
from .description import JointGroup as JointGroup
from .description import Robot as Robot
from .humanoid import humanoid as humanoid
from .named import ROBOTS as ROBOTS
from .named import make_robot as make_robot
from .retarget import Retargeting as Retargeting
from .unitree import unitree_g1 as unitree_g1
