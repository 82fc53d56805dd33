"""What is recognised in recordings, as a tidy table, and in the formats of motion science."""

from ..library import RecognisedSegment as RecognisedSegment
from ..library import SegmentTable as SegmentTable
from .files import FORMATS as FORMATS
from .files import format_of as format_of
from .files import read_segments as read_segments
from .files import write_segments as write_segments
from .movement import as_dataset as as_dataset
from .movement import from_dataset as from_dataset
from .recognising import recognise_recording as recognise_recording
from .recognising import seen_by as seen_by
from .recognising import segments_of as segments_of
