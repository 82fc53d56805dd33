"""Follow one frame of markers from the cameras to a servo.

python examples/follow_a_frame.py
"""

from mplearn import LearnerConfig, MotionLearner
from mplearn.body import MotionObserver, view_of
from mplearn.demonstrator import demonstrate
from mplearn.learner import Recognised
from mplearn_envs.execution.simulation import Simulation
from mplearn_envs.mechanics import rest_reference
from mplearn_envs.robot import humanoid
from mplearn_envs.skills.skills import Skills

recording = demonstrate(["BAD", "BAU"] * 4, seed=1).recording
at = 1300  # the frame that is followed
wrist = recording.marker_names.index("RWRA")
place = recording.markers[at, wrist].round(3)
print(f"cameras: {len(recording.marker_names)} markers; a wrist at {place} m")

# What the learner does with the frame inside, done by hand: posture, features, view.
observer = MotionObserver(recording.marker_names, recording.rate_hz)
features = observer.observe(recording.frames)
elbow = observer.channels.index("elbow_r")
print(f"features: {len(observer.channels)} of them; the elbow at {features[at, elbow]:.2f} rad")
view = view_of(observer.channels)
seen = view.see(features[at : at + 1])
print(f"view: {seen.shape[1]} channels, from which the features come back:", end=" ")
print(f"{view.read(seen)[0, elbow]:.2f} rad")

# The learner does all that, and cuts, compares, counts.
learner = MotionLearner(LearnerConfig(recording.channels, recording.rate_hz))
for frame in recording.frames:
    for event in learner.learn_one(frame):
        match event:
            case Recognised(segment, primitive) if segment.start <= at < segment.end:
                print(f"segment: [{segment.start}, {segment.end}), ended by a {segment.cause}")
                print(f"primitive: its id is {primitive}")
                performed = primitive
learner.end_stream()
library = learner.snapshot()
shown = library[performed]
print(f"library: {len(library)} primitives; {shown.name} was shown {shown.n_exemplars} times")

# And back: a motion of our body, one of the robot, a plan, servo commands, the robot.
motion = library.generate([performed])
print(f"motion: {len(motion.frames)} frames of {motion.frames.shape[1]} features")
robot = humanoid()
skills = Skills(library, robot, speed=0.5)
plan = skills.plan(rest_reference(robot), performed)
servo = robot.joint_names.index("elbow_r")
n_commands, n_servos = plan.commands.shape
print(f"plan: {n_commands} commands in {plan.duration_s:.1f} s to {n_servos} servos")
simulation = Simulation(robot)
simulation.reset()
report = simulation.perform(plan)
print(f"servo: the elbow's was last sent to {simulation.data.ctrl[servo]:.2f} rad;", end=" ")
print(f"joints were off by {report.tracking_error_rad.max():.1e} rad at most")
assert not report.fallen
