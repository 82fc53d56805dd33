"""What runs at control rate: upper-body tracking, balance on both feet, and ankle feedback."""

from .balance import BalanceController as BalanceController
from .standing import Controller as Controller
from .standing import StandingController as StandingController
from .upper_body import UpperBodyTracker as UpperBodyTracker
