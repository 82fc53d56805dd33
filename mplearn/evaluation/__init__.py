"""How well it works: sessions, matching against the truth, the paper's rates, experiments."""

from .annotations import Annotations as Annotations
from .annotations import read_annotations as read_annotations
from .boundaries import BoundaryScore as BoundaryScore
from .boundaries import score_boundaries as score_boundaries
from .contents import content_of as content_of
from .matching import Matching as Matching
from .matching import match_segments as match_segments
from .observing import observe as observe
from .ownership import OwnershipRates as OwnershipRates
from .ownership import rate_ownership as rate_ownership
from .rates import LearningRates as LearningRates
from .rates import rate_learning as rate_learning
from .sessions import SessionConfig as SessionConfig
from .sessions import make_session as make_session
from .suitable import LabelKind as LabelKind
from .suitable import alike as alike
from .suitable import kind_of_labels as kind_of_labels
from .suitable import lost_throughout as lost_throughout
from .suitable import repeating as repeating
from .table import Table as Table
