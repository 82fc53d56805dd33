"""The formats, one a file; those that are here are registered."""

from ..registry import register_format
from .bvh import BVH
from .gltf import GLTF
from .gmr import GMRNPZ
from .html import HTMLFilm
from .lerobot import LeRobot
from .mcap import MCAP
from .mjlab import MjlabNPZ
from .ndjson import NDJSON
from .unitree import UnitreeCSV

for _format in (
    UnitreeCSV(),
    MjlabNPZ(),
    GMRNPZ(),
    BVH(),
    LeRobot(),
    MCAP(),
    NDJSON(),
    HTMLFilm(),
    GLTF(),
):
    register_format(_format)
