"""Words on pictures."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mplearn_agents.extras import require


def captioned(picture: NDArray[np.uint8], text: str, note: str = "") -> NDArray[np.uint8]:
    """Return the picture with a line at its foot and a smaller note at its right.

    Raises:
        MissingDependencyError: pillow, which matplotlib brings, is not installed.
    """
    image = require("PIL.Image", "report").fromarray(picture)
    draw = require("PIL.ImageDraw", "report").Draw(image, "RGBA")
    height = image.height
    size = max(11, height // 19)
    top = height - round(1.9 * size)
    draw.rectangle((0, top, image.width, height), fill=(18, 28, 42, 205))
    line = top + round(0.38 * size)
    draw.text((0.9 * size, line), text, font=_font(size), fill=(255, 255, 255, 255))
    small = _font(round(0.75 * size))
    right = image.width - 0.9 * size - draw.textlength(note, font=small)
    draw.text((right, line + 0.14 * size), note, font=small, fill=(190, 202, 216, 255))
    return np.asarray(image)


@cache
def _font(size: int) -> Any:
    manager = require("matplotlib.font_manager", "report")
    return require("PIL.ImageFont", "report").truetype(manager.findfont("DejaVu Sans"), size)
