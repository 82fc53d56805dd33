"""Recognised as a body: which point of a recording is which place of a person."""

from .body_map import BodyMap as BodyMap
from .map_file import read_map as read_map
from .markers import recognise_markers as recognise_markers
from .skeletons import recognise_skeleton as recognise_skeleton
from .takes import Bodies as Bodies
from .takes import as_bodies as as_bodies
from .takes import recognise as recognise
