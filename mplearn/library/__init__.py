"""The primitive library: frozen, versioned snapshots of what was learned."""

from .compact import CompactMotion as CompactMotion
from .library import PrimitiveLibrary as PrimitiveLibrary
from .novelty import AnomalyScore as AnomalyScore
from .novelty import MotionNovelty as MotionNovelty
from .primitive import Primitive as Primitive
from .primitive import TreeNode as TreeNode
from .segment_table import RecognisedSegment as RecognisedSegment
from .segment_table import SegmentTable as SegmentTable
