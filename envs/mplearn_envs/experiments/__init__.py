"""Experiments with the robot: each returns a table."""

from .learned import learned_table as learned_table
from .pushes import push_table as push_table
from .walks import Walk as Walk
from .walks import primitive_table as primitive_table
from .walks import random_walks as random_walks
from .walks import speed_table as speed_table
from .walks import walk_table as walk_table
