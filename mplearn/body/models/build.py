"""Write the committed models: ``python -m mplearn.body.models.build``.

The bodies are drawn with ``dm_control.mjcf``; the library itself only reads the MJCF texts written
here.
"""

from __future__ import annotations

from pathlib import Path

from .human_model import build_human
from .mjcf import to_xml
from .robot import build_robot


def models() -> dict[str, str]:
    """Return the MJCF text of each body, by name."""
    return {"human": to_xml(build_human()), "robot": to_xml(build_robot())}


def main() -> None:
    """Write all models into the package."""
    folder = Path(__file__).parent
    for name, xml in models().items():
        (folder / f"{name}.xml").write_text(xml, encoding="utf-8")


if __name__ == "__main__":
    main()
