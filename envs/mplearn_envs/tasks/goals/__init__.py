"""What may be a goal: a kind a file."""

from .base import Goal as Goal
from .base import GoalKind as GoalKind
from .hand import HandGoals as HandGoals
from .posture import PostureGoals as PostureGoals
from .primitive import PrimitiveGoals as PrimitiveGoals
