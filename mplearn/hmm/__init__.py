"""Left-right hidden Markov models of motions, in log space: plain, semi-Markov and factorial."""

from .distance import distance as distance
from .distance import distance_matrix as distance_matrix
from .factorial.fit import add_chain as add_chain
from .factorial.fit import em_step as em_step
from .factorial.fit import fit_factorial as fit_factorial
from .factorial.fit import needs_more_chains as needs_more_chains
from .factorial.model import FactorialHMM as FactorialHMM
from .fit import fit as fit
from .interchange import from_hmmlearn as from_hmmlearn
from .interchange import to_hmmlearn as to_hmmlearn
from .model import LeftRightHMM as LeftRightHMM
from .motion_model import MotionModel as MotionModel
from .selection import SizeSelection as SizeSelection
from .selection import select_size as select_size
from .semi_markov.model import SemiMarkovHMM as SemiMarkovHMM
from .semi_markov.model import fit_semi_markov as fit_semi_markov
from .sequences import SequenceBatch as SequenceBatch
from .stack import ModelStack as ModelStack
from .stack import score_batch as score_batch
from .stack import score_pairs as score_pairs
from .tracker import MotionTracker as MotionTracker
from .tracker import activity as activity
