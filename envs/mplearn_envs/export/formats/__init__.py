"""The formats, one a file; those that are here are registered."""

from ..registry import register_format
from .bvh import BVH
from .gmr import GMRNPZ
from .mjlab import MjlabNPZ
from .ndjson import NDJSON
from .unitree import UnitreeCSV

for _format in (UnitreeCSV(), MjlabNPZ(), GMRNPZ(), BVH(), NDJSON()):
    register_format(_format)
