"""The motion primitive graph: learned transitions, paths, walks, prediction [Kulic2012, 3]."""

from .prediction import History as History
from .prediction import Prediction as Prediction
from .transition_graph import TransitionGraph as TransitionGraph
