"""Controllers of the robot: upper-body tracking, balance, and plans that join them."""

from .balance import BalanceController as BalanceController
from .cog_filter import CogFilter as CogFilter
from .controller import Controller as Controller
from .controller import StandingController as StandingController
from .plan import Motion as Motion
from .plan import Plan as Plan
from .planner import Planner as Planner
from .planner import PlannerConfig as PlannerConfig
from .reference import Reference as Reference
from .reference import reference_robot as reference_robot
from .reference import rest_reference as rest_reference
from .upper_body import UpperBodyTracker as UpperBodyTracker
from .upper_body import servo_commands as servo_commands
