"""The learner: where the stages meet, frame after frame."""

from .buffer import FrameBuffer as FrameBuffer
from .config import LearnerConfig as LearnerConfig
from .config import learnable_rate as learnable_rate
from .events import Anomaly as Anomaly
from .events import AxesChanged as AxesChanged
from .events import Event as Event
from .events import FramesLost as FramesLost
from .events import PersonChanged as PersonChanged
from .events import PrimitiveBorn as PrimitiveBorn
from .events import PrimitiveConfirmed as PrimitiveConfirmed
from .events import PrimitiveForgotten as PrimitiveForgotten
from .events import PrimitiveMerged as PrimitiveMerged
from .events import PrimitiveSplit as PrimitiveSplit
from .events import Recognised as Recognised
from .events import SegmentClosed as SegmentClosed
from .events import TransitionSeen as TransitionSeen
from .events import plain_event as plain_event
from .foresight import NextMotion as NextMotion
from .learner import MotionLearner as MotionLearner
from .learner_state import LearnerState as LearnerState
from .reversal import Known as Known
from .reversal import LearnerEdit as LearnerEdit
from .shown_once import with_takes as with_takes
from .watching import Watching as Watching
