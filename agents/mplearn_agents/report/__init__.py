"""The self-contained page that shows what was learned and how it is performed."""

from .library_page import library_figures as library_figures
from .library_page import library_page as library_page
from .page import Page as Page
from .page import render_page as render_page
