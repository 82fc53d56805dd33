"""Markers that vanish for a moment, followed through their gaps."""

from .tracker import GapConfig as GapConfig
from .tracker import GapsState as GapsState
from .tracker import GapTracker as GapTracker
