"""Let another humanoid perform what was learned: any MJCF on two feet, here a person of 1.6 m.

python examples/own_robot.py
"""

import gymnasium as gym

import mplearn_envs  # noqa: F401  (registers the environments)
from mplearn.body import human_body
from mplearn_envs.robot import ROLES, Robot

# A file's path would do as well; each role of a body part is given the name of the MJCF's body.
model = human_body(1.6).xml
robot = Robot.from_mjcf(model, "person", segments={role: role for role in ROLES})
print(f"{robot.name}: {len(robot.joint_names)} driven joints")

env = gym.make("mplearn/PrimitiveHumanoid-v0", robot=robot, dynamics="kinematic")
observation, info = env.reset(seed=1)
performed = 0
for _ in range(4):
    action = int(info["transition_prior"].argmax())  # what most often follows
    observation, reward, terminated, truncated, info = env.step(action)
    performed += not terminated
    print(f"{info['primitive_name']}: {info['duration_s']:.1f} s")
env.close()
assert performed == 4
