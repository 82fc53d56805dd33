"""Experiments with the robot: each returns a table."""

from .learned import learned_table as learned_table
from .pushes import push_table as push_table
from .soak import soak_table as soak_table
from .survival import survival_table as survival_table
from .walk_tables import primitive_table as primitive_table
from .walk_tables import speed_table as speed_table
from .walk_tables import walk_table as walk_table
from .walks import Walk as Walk
from .walks import random_walks as random_walks
