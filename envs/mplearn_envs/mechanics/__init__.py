"""A robot as arrays: kinematics, masses, momentum, gravity, support, and its legs' velocity IK."""

from .reference import Reference as Reference
from .reference import ReferenceRobot as ReferenceRobot
from .reference import reference_robot as reference_robot
from .reference import rest_reference as rest_reference
