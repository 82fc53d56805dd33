"""Words on pictures."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mplearn.extras import require
from mplearn_agents.terminal.inert import printable


def captioned(picture: NDArray[np.uint8], text: str, note: str = "") -> NDArray[np.uint8]:
    """Return the picture with a line in its upper left and a smaller note in its upper right.

    The foot of a picture is left free: there a player shows its buttons.

    Raises:
        MissingDependencyError: pillow, which matplotlib brings, is not installed.

    Example:
        >>> import numpy as np
        >>> blank = np.full((120, 320, 3), 255, np.uint8)
        >>> written = captioned(blank, "bow down", "0.5 of the speed")
        >>> written.shape, bool((written != blank).any())
        ((120, 320, 3), True)
    """
    text, note = printable(text), printable(note)
    image = require("PIL.Image", "report").fromarray(picture)
    draw = require("PIL.ImageDraw", "report").Draw(image, "RGBA")
    size = max(11, image.height // 20)
    edge, small = round(0.8 * size), _font(round(0.75 * size))
    width = draw.textlength(text, font=_font(size))
    box = (edge, edge, edge + width + 1.2 * size, edge + 1.9 * size)
    draw.rounded_rectangle(box, radius=0.5 * size, fill=(18, 28, 42, 215))
    middle = edge + 0.95 * size
    draw.text((edge + 0.6 * size, middle), text, font=_font(size), fill="white", anchor="lm")
    draw.text((image.width - edge, middle), note, font=small, fill=(70, 84, 102), anchor="rm")
    return np.asarray(image)


@cache
def _font(size: int) -> Any:
    manager = require("matplotlib.font_manager", "report")
    return require("PIL.ImageFont", "report").truetype(manager.findfont("DejaVu Sans"), size)
