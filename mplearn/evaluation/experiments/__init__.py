"""The experiments of the paper, each a function that returns a table or the outcomes for one."""

from .boundaries import boundary_table as boundary_table
from .learning import Outcome as Outcome
from .learning import learn_session as learn_session
from .learning import learning_table as learning_table
from .sessions import by_person as by_person
from .sessions import learn_paper_sessions as learn_paper_sessions
from .sessions import learn_people as learn_people
