"""Learn motion primitives and their order on-line by watching people, and generate motion.

These names are the library's front door; docs/structure.md describes the rooms behind it.
"""

from .errors import MPLearnError as MPLearnError
from .learner import LearnerConfig as LearnerConfig
from .learner import MotionLearner as MotionLearner
from .library import PrimitiveLibrary as PrimitiveLibrary
from .mocap import open_recording as open_recording
from .mocap import open_recordings as open_recordings
from .recording import LabelledSegment as LabelledSegment
from .recording import Recording as Recording
from .recording import Segment as Segment
