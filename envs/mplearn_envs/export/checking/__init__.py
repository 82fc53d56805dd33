"""Checks of files: what they say against themselves, what was meant, and what a robot can do."""

from .check import Verdict as Verdict
from .check import check as check
