"""Markers that vanish for a moment, followed through their gaps."""

from .tracker import GapConfig as GapConfig
from .tracker import GapTracker as GapTracker
