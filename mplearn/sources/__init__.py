"""Motion as it happens: recordings at their own pace, the demonstrator, and live streams."""

from .buffered import BufferedSource as BufferedSource
from .opening import open_source as open_source
from .registry import Observe as Observe
from .registry import Wanted as Wanted
from .registry import connect as connect
from .registry import register_source as register_source
from .registry import source_kinds as source_kinds
from .source import Block as Block
from .source import Change as Change
from .source import Source as Source
from .source import Stream as Stream
from .source import Tally as Tally
