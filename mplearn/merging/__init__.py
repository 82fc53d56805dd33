"""Two become one: learners, people and their bodies, trees and graphs that were learned apart."""

from .bodies import merge_bodies as merge_bodies
from .graphs import merge_graphs as merge_graphs
from .learners import merge_learners as merge_learners
from .learners import merged_learner as merged_learner
from .learners import merged_state as merged_state
from .observers import merge_observers as merge_observers
from .people import merge_people as merge_people
from .trees import merge_trees as merge_trees
from .watching import merge_watching as merge_watching
