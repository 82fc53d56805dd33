"""The demonstrator: a synthetic person who performs primitives before cameras, with the truth."""

from .demonstration import Demonstration as Demonstration
from .demonstration import demonstrate as demonstrate
from .demonstration import paper_session as paper_session
from .demonstrator import Demonstrator as Demonstrator
from .performance import Block as Block
from .person import Person as Person
from .primitives import GYMNASTICS as GYMNASTICS
from .primitives import PAPER_PRIMITIVES as PAPER_PRIMITIVES
from .primitives import PRIMITIVES as PRIMITIVES
from .primitives import Primitive as Primitive
from .primitives import followers as followers
from .sequencing import SEQUENCING as SEQUENCING
from .sequencing import VARIED as VARIED
from .sequencing import drawn_sequencing as drawn_sequencing
from .sequencing import markov_script as markov_script
from .sequencing import markov_walk as markov_walk
from .variability import Variability as Variability
