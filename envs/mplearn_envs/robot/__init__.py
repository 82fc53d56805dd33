"""Robots: the humanoid of the experiments, and the description through which others come in."""

from .description import Robot as Robot
from .drives import JointGroup as JointGroup
from .humanoid import humanoid as humanoid
from .named import ROBOTS as ROBOTS
from .named import make_robot as make_robot
from .packaged import unitree_g1 as unitree_g1
from .retarget import Retargeting as Retargeting
from .robot_file import described_robot as described_robot
from .roles import BASE_CHANNELS as BASE_CHANNELS
from .roles import NEEDED_ROLES as NEEDED_ROLES
from .roles import ROLES as ROLES
