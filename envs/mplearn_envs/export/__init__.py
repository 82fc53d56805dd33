"""What a robot performs, in the files of other tools; and checks of such files.

`perform` makes motions of a library, a path or a walk, `as_shown` one without a robot's plans;
`export` writes them, `check` says what is wrong with a file. `register_format` joins a format of
one's own.
"""

from . import formats as _formats  # noqa: F401  (registers them)
from .checking import Verdict as Verdict
from .checking import check as check
from .exporting import export as export
from .format import Dialect as Dialect
from .format import Format as Format
from .format import Reading as Reading
from .motion import RobotMotion as RobotMotion
from .motion import Span as Span
from .performing import Performed as Performed
from .performing import perform as perform
from .registry import format_of as format_of
from .registry import formats as formats
from .registry import register_format as register_format
from .robot_model import RobotModel as RobotModel
from .robot_model import robot_model as robot_model
from .shown import as_shown as as_shown
