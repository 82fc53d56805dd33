"""From a motion to commands for the whole robot: footwork, times, weight, postures."""

from .plan import Motion as Motion
from .plan import Plan as Plan
from .plan import PlannerConfig as PlannerConfig
from .plan import joined as joined
from .planner import Planner as Planner
