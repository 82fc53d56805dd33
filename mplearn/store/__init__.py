"""A life of learning: a learner with commands, undo and history, and the file that keeps it all."""

from .commands import Command as Command
from .commands import Delete as Delete
from .commands import Freeze as Freeze
from .commands import Merge as Merge
from .commands import Note as Note
from .commands import Operation as Operation
from .commands import Pause as Pause
from .commands import Redo as Redo
from .commands import Rename as Rename
from .commands import Resume as Resume
from .commands import Split as Split
from .commands import Undo as Undo
from .commands import Unfreeze as Unfreeze
from .commands import register_command as register_command
from .journal import Entry as Entry
from .journal import Happening as Happening
from .life import LifelongLearner as LifelongLearner
from .reader import StoreReader as StoreReader
from .reader import learner_of as learner_of
from .reader import library_of as library_of
from .store import Store as Store
from .store import StoreInfo as StoreInfo
from .store import backup as backup
from .store import check as check
from .store import info as info
from .store import is_begun as is_begun
