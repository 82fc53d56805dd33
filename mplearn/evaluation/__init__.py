"""How well it works: sessions, matching against the truth, the paper's rates, experiments."""

from .boundaries import BoundaryScore as BoundaryScore
from .boundaries import score_boundaries as score_boundaries
from .matching import Matching as Matching
from .matching import match_segments as match_segments
from .observing import observe as observe
from .rates import LearningRates as LearningRates
from .rates import rate_learning as rate_learning
from .sessions import SessionConfig as SessionConfig
from .sessions import make_session as make_session
from .suitable import LabelKind as LabelKind
from .suitable import alike as alike
from .suitable import kind_of_labels as kind_of_labels
from .suitable import repeating as repeating
from .table import Table as Table
