"""Recordings of human motion from files, and markers followed through their gaps."""

from .gaps import GapConfig as GapConfig
from .gaps import GapTracker as GapTracker
from .joining import join_by_name as join_by_name
from .joining import with_channels as with_channels
from .open import FoundTakes as FoundTakes
from .open import TakeFiles as TakeFiles
from .open import Takes as Takes
from .open import find_takes as find_takes
from .open import open_recording as open_recording
from .open import open_recordings as open_recordings
from .open import open_takes as open_takes
from .open import take_names as take_names
from .options import command_line as command_line
from .people import each_person as each_person
from .placing.size import UNITS_M as UNITS_M
from .placing.size import named_unit as named_unit
from .reader import DIRECTIONS as DIRECTIONS
from .reader import Hints as Hints
from .reader import Reader as Reader
from .registry import readers as readers
from .registry import register_reader as register_reader
from .resample import resample as resample
