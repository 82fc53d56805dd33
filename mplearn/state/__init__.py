"""States: what an object remembers, typed; and the one way to bytes and back."""

from .checkpoint import Checkpoint as Checkpoint
from .checkpoint import checkpoint as checkpoint
from .checkpoint import from_bytes as from_bytes
from .checkpoint import hash_of as hash_of
from .checkpoint import key_of as key_of
from .checkpoint import resumed as resumed
from .checkpoint import to_bytes as to_bytes
from .declared import Blob as Blob
from .declared import SharedState as SharedState
from .declared import State as State
from .declared import fields_of as fields_of
from .declared import to_plain as to_plain
from .fields import LARGEST as LARGEST
from .fields import WHOLE as WHOLE
from .fields import Array as Array
from .fields import Count as Count
from .fields import Range as Range
from .fields import complete as complete
from .fields import newer as newer
from .fields import require as require
from .fields import require_no_cycle as require_no_cycle
from .fields import saved_as as saved_as
from .files import FileFormat as FileFormat
from .structure import from_plain as from_plain
from .structure import validated as validated
from .structure import within as within
