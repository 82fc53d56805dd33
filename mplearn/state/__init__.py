"""States: what an object remembers, typed; and the one way to bytes and back."""

from .checkpoint import Checkpoint as Checkpoint
from .checkpoint import checkpoint as checkpoint
from .checkpoint import resumed as resumed
from .declared import LARGEST as LARGEST
from .declared import WHOLE as WHOLE
from .declared import Array as Array
from .declared import Blob as Blob
from .declared import Count as Count
from .declared import Range as Range
from .declared import SharedState as SharedState
from .declared import State as State
from .declared import complete as complete
from .declared import newer as newer
from .declared import require as require
from .declared import require_no_cycle as require_no_cycle
from .files import FileFormat as FileFormat
from .plain import fields_of as fields_of
from .plain import to_plain as to_plain
from .structure import from_plain as from_plain
from .structure import validated as validated
from .structure import within as within
