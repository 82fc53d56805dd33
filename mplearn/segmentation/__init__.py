"""Segmentation of a stream of motion into candidates for primitives, on-line."""

from .base import Segmenter as Segmenter
from .registry import SEGMENTERS as SEGMENTERS
from .registry import make_segmenter as make_segmenter
from .zero_velocity import ZeroVelocity as ZeroVelocity
from .zero_velocity import ZeroVelocityConfig as ZeroVelocityConfig
