"""Kinematic bodies, marker sets and on-line inverse kinematics: from markers to joint angles."""

from .body import Body as Body
from .calibration import Calibration as Calibration
from .features import feature_channels as feature_channels
from .features import features_of as features_of
from .features import posture_of as posture_of
from .first_posture import TooFewMarkersError as TooFewMarkersError
from .human import PROPORTIONS as PROPORTIONS
from .human import human_body as human_body
from .inverse_kinematics import IKConfig as IKConfig
from .inverse_kinematics import InverseKinematics as InverseKinematics
from .keypoints import KEYPOINTS as KEYPOINTS
from .keypoints import keypoint_channels as keypoint_channels
from .keypoints import keypoints_of as keypoints_of
from .markers import MarkerSet as MarkerSet
from .markers import find_marker_set as find_marker_set
from .markers import marker_set as marker_set
from .observer import MotionObserver as MotionObserver
from .observer import ObserverState as ObserverState
from .observer import Watched as Watched
from .robot import robot_body as robot_body
from .tree import KinematicTree as KinematicTree
from .view import BodyView as BodyView
from .view import PlainView as PlainView
from .view import View as View
from .view import view_of as view_of
