"""The figures of the report: each a function from plain values to a matplotlib figure."""

from .curves import PrimitiveCurves as PrimitiveCurves
from .curves import draw_curves as draw_curves
from .graph import draw_graph as draw_graph
from .progress import draw_progress as draw_progress
from .stream import StripSegment as StripSegment
from .stream import draw_stream as draw_stream
from .theme import data_uri as data_uri
from .theme import figure_style as figure_style
from .theme import readable as readable
from .theme import save_png as save_png
from .theme import svg_uri as svg_uri
from .tree import draw_tree as draw_tree
