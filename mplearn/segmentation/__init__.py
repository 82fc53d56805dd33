"""Segmentation of a stream of motion into candidates for primitives, on-line."""

from .base import Segmenter as Segmenter
from .base import SegmenterState as SegmenterState
from .kinematic_centroid import KinematicCentroid as KinematicCentroid
from .kinematic_centroid import KinematicCentroidConfig as KinematicCentroidConfig
from .kohlmorgen_lemm import KohlmorgenLemm as KohlmorgenLemm
from .kohlmorgen_lemm import KohlmorgenLemmConfig as KohlmorgenLemmConfig
from .registry import SEGMENTERS as SEGMENTERS
from .registry import make_segmenter as make_segmenter
from .registry import register_segmenter as register_segmenter
from .registry import require_segmenter as require_segmenter
from .speed import ZeroVelocityConfig as ZeroVelocityConfig
from .turns import TurnConfig as TurnConfig
from .upsampling import Upsampled as Upsampled
from .upsampling import upsampled as upsampled
from .zero_velocity import ZeroVelocity as ZeroVelocity
