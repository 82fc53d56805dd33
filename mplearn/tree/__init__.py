"""The incremental tree of motion primitives."""

from .config import FormConfig as FormConfig
from .config import TreeConfig as TreeConfig
from .mirror import MirrorMap as MirrorMap
from .node import Node as Node
from .placement import ROOT as ROOT
from .placement import Change as Change
from .placement import Match as Match
from .placement import Merge as Merge
from .placement import Placement as Placement
from .placement import Reparent as Reparent
from .placement import Split as Split
from .recogniser import Recogniser as Recogniser
from .recogniser import Recognition as Recognition
from .relations import Relation as Relation
from .relations import related as related
from .tree import PrimitiveTree as PrimitiveTree
