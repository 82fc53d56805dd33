"""What tests of the link share: a robot, and a posture of its upper body."""

import numpy as np

from mplearn_envs.link.datagram import base_frame
from mplearn_envs.robot import humanoid

ROBOT = humanoid()
N = len(ROBOT.upper_joints)
CODE = 77
PERIOD_S = 0.004


def posture(seed=0):
    rng = np.random.default_rng(seed)
    return base_frame(0.8, *rng.normal(0, 0.3, 2)), rng.normal(0, 0.5, N)
