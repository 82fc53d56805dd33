"""From primitives and paths to motion: generation in several styles, and retiming to limits."""

from .dynamics import Dynamics as Dynamics
from .dynamics import estimate_dynamics as estimate_dynamics
from .gaps import gaps_filled as gaps_filled
from .generate import generate as generate
from .retime import retime as retime
from .schedule import GenerativePrimitive as GenerativePrimitive
from .styles import STYLES as STYLES
from .styles import StyleName as StyleName
from .trajectory import Trajectory as Trajectory
