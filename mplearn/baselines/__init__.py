"""Peers of the paper, to be measured beside our own way."""

from .posture_graph import PostureGraph as PostureGraph
from .splitting import minimum_error_split as minimum_error_split
