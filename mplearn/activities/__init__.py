"""Activities: what goes on in a recording at a scale coarser than primitives."""

from .config import ActivityConfig as ActivityConfig
from .find import find_activities as find_activities
from .postures import postures_of as postures_of
