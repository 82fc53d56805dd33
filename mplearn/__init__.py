"""Learn motion primitives and their order on-line by watching people, and generate motion.

These names are the library's front door; docs/structure.md describes the rooms behind it. A room is
loaded when something of it is first asked for.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from .offers import offer

if TYPE_CHECKING:
    from .errors import MPLearnError as MPLearnError
    from .learner import LearnerConfig as LearnerConfig
    from .learner import MotionLearner as MotionLearner
    from .library import PrimitiveLibrary as PrimitiveLibrary
    from .merging import merge_learners as merge_learners
    from .mocap import open_recording as open_recording
    from .mocap import open_recordings as open_recordings
    from .recording import LabelledSegment as LabelledSegment
    from .recording import Recording as Recording
    from .recording import Segment as Segment

_ROOMS = {
    "MPLearnError": "errors",
    "LearnerConfig": "learner",
    "MotionLearner": "learner",
    "PrimitiveLibrary": "library",
    "merge_learners": "merging",
    "open_recording": "mocap",
    "open_recordings": "mocap",
    "LabelledSegment": "recording",
    "Recording": "recording",
    "Segment": "recording",
}

__all__ = sorted(_ROOMS)

offer("read a library from a store", by="mplearn.store:library_of")
offer("find the segments of a recording", by="mplearn.tables:segments_of")


def __getattr__(name: str) -> Any:
    if name not in _ROOMS:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f".{_ROOMS[name]}", __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_ROOMS})
