"""Who performs: the simulated robot, or its plans taken at their word."""

from .base import Outcome as Outcome
from .base import Performer as Performer
from .base import PerformerState as PerformerState
from .modes import Dynamics as Dynamics
from .modes import make_performer as make_performer
