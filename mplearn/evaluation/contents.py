"""What a recording shows, by its name: its content and the style in which it is performed.

Collections of styled motion name files so, as ``dataset-2_walk-turn-left_active_001`` in Bandai
Namco Research's: the content's words and the style's are joined by dashes, then comes a number.
"""

from __future__ import annotations

import re
from typing import NamedTuple

_WORDS = r"[a-z]+(?:-[a-z]+)*"
_NAME = re.compile(rf"(?:[a-z]+-\d+_)?(?P<content>{_WORDS})_(?P<style>{_WORDS})_\d+", re.ASCII)
_TURNS = re.compile(r"-turn-(?:left|right)$")
_RAISED = re.compile(r"^(?:raise-up|raise|wave)-(?=(?:left|right|both)-)")


class Content(NamedTuple):
    """What a recording shows.

    Attributes:
        content: The motion, as ``"walk-turn-left"``.
        style: How it is performed, as ``"active"``.
    """

    content: str
    style: str


def content_of(name: str) -> Content | None:
    """Return the content and the style that a recording's name tells; None where it tells none.

    >>> content_of("dataset-2_walk-turn-left_active_001")
    Content(content='walk-turn-left', style='active')
    """
    found = _NAME.fullmatch(name)
    return None if found is None else Content(found["content"], found["style"])


def merged(content: str) -> str:
    """Return the name under which contents that may share primitives are one.

    Relative to the pelvis, walking while turning is walking; and waving begins with raising.

    >>> merged("walk-turn-left"), merged("wave-left-hand"), merged("raise-up-left-hand")
    ('walk', 'left-hand', 'left-hand')
    """
    return _RAISED.sub("", _TURNS.sub("", content))
