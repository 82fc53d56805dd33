"""Kinematic bodies, marker sets and on-line inverse kinematics: from markers to joint angles."""

from .body import Body as Body
from .calibration import Calibration as Calibration
from .human import PROPORTIONS as PROPORTIONS
from .human import human_body as human_body
from .inverse_kinematics import IKConfig as IKConfig
from .inverse_kinematics import InverseKinematics as InverseKinematics
from .markers import MarkerSet as MarkerSet
from .markers import find_marker_set as find_marker_set
from .markers import marker_set as marker_set
from .robot import robot_body as robot_body
from .tree import KinematicTree as KinematicTree
