"""Recordings of human motion from files, and markers followed through their gaps."""

from .gaps import GapConfig as GapConfig
from .gaps import GapTracker as GapTracker
from .open import READERS as READERS
from .open import open_recording as open_recording
from .open import open_recordings as open_recordings
from .open import take_names as take_names
from .reader import Hints as Hints
from .reader import Reader as Reader
from .resample import resample as resample
