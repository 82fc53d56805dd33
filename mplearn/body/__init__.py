"""Kinematic bodies, marker sets and on-line inverse kinematics: from markers to joint angles."""

from .inverse_kinematics.calibration import Calibration as Calibration
from .inverse_kinematics.first_posture import TooFewMarkersError as TooFewMarkersError
from .inverse_kinematics.inverse_kinematics import IKConfig as IKConfig
from .inverse_kinematics.inverse_kinematics import InverseKinematics as InverseKinematics
from .kinematics.tree import KinematicTree as KinematicTree
from .marker_sets.marker_set import MarkerSet as MarkerSet
from .marker_sets.marker_set import find_marker_set as find_marker_set
from .marker_sets.marker_set import marker_set as marker_set
from .models.body import Body as Body
from .models.human import PROPORTIONS as PROPORTIONS
from .models.human import human_body as human_body
from .models.robot import robot_body as robot_body
from .observer.observer import MotionObserver as MotionObserver
from .observer.observer import ObserverState as ObserverState
from .observer.observer import Watched as Watched
from .views.features import feature_channels as feature_channels
from .views.features import features_of as features_of
from .views.features import posture_of as posture_of
from .views.keypoints import KEYPOINTS as KEYPOINTS
from .views.keypoints import keypoint_channels as keypoint_channels
from .views.keypoints import keypoints_of as keypoints_of
from .views.view import BodyView as BodyView
from .views.view import PlainView as PlainView
from .views.view import View as View
from .views.view import view_of as view_of
