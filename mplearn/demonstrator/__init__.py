"""The demonstrator: a synthetic person who performs motion primitives before a camera, with the truth."""

from .demonstrator import Block as Block
from .demonstrator import Demonstration as Demonstration
from .demonstrator import Demonstrator as Demonstrator
from .demonstrator import demonstrate as demonstrate
from .person import Person as Person
from .primitives import PAPER_PRIMITIVES as PAPER_PRIMITIVES
from .primitives import PRIMITIVES as PRIMITIVES
from .primitives import Primitive as Primitive
from .primitives import followers as followers
from .sequencing import SEQUENCING as SEQUENCING
from .sequencing import markov_script as markov_script
from .sequencing import markov_walk as markov_walk
from .session import paper_session as paper_session
from .variability import Variability as Variability
