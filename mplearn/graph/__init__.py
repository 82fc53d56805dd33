"""The motion primitive graph: learned transitions, paths, walks, prediction [Kulic2012, 3]."""

from .constraints import Asked as Asked
from .graph_state import GraphState as GraphState
from .levels import LevelledGraph as LevelledGraph
from .levels import tree_levels as tree_levels
from .prediction import History as History
from .prediction import Prediction as Prediction
from .provisional_graph import ProvisionalGraph as ProvisionalGraph
from .reversal import GraphEdit as GraphEdit
from .transition_graph import Criterion as Criterion
from .transition_graph import MergedGraph as MergedGraph
from .transition_graph import TransitionGraph as TransitionGraph
