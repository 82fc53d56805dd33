"""Several people in one stream: one primitive is one node, with a leaf for each person below it."""

from .config import PeopleConfig as PeopleConfig
from .people_state import PeopleState as PeopleState
from .people_tree import PeopleTree as PeopleTree
from .reversal import PeopleEdit as PeopleEdit
