"""What is asked of recognised motion: how often, how long, how even, how well, and who differs."""

from .comparison import Comparison as Comparison
from .comparison import compare as compare
from .comparison import compare_transitions as compare_transitions
from .measures import MEASURES as MEASURES
from .measures import Measure as Measure
from .measures import durations as durations
from .measures import repetitions as repetitions
from .measures import spread as spread
from .measures import tempo as tempo
from .measures import variability as variability
from .plots import plot_measure as plot_measure
from .plots import plot_quality as plot_quality
from .plots import plot_transitions as plot_transitions
from .quality import quality as quality
from .transitions import Transitions as Transitions
from .transitions import transitions as transitions
