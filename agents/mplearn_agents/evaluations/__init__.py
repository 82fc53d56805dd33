"""What ``mplearn evaluate`` runs: experiments by name, for each kind of data."""

from .setting import Setting as Setting
from .suites import BUILT_IN as BUILT_IN
from .suites import evaluations_for as evaluations_for
