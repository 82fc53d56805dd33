"""What MkDocs calls while it builds the site.

Formulas become MathML, rooms become pages of the reference, and a drawing of what they import.
"""

from __future__ import annotations

import html
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

from latex2mathml.converter import convert
from mkdocs.structure.files import File, Files

FORMULA = re.compile(r'<(span|div) class="arithmatex">\\([(\[])(.*?)\\[)\]]</\1>', re.DOTALL)

KEYS = re.findall(
    r"^\| \[(\w+)\]", (Path(__file__).parent / "references.md").read_text("utf-8"), re.MULTILINE
)
SOURCE = re.compile(rf"\[({'|'.join(KEYS)})\b")

#: Where the packages lie whose rooms get a page of the reference each.
PACKAGES = {
    "mplearn": "mplearn",
    "mplearn_envs": "envs/mplearn_envs",
    "mplearn_agents": "agents/mplearn_agents",
}

#: Modules that get a page, too: beside the rooms, or of rooms whose doors import nothing.
MODULES = (
    "mplearn.errors",
    "mplearn.recording",
    "mplearn.maths.rotations",
    "mplearn_envs.checks",
    *(
        f"mplearn_envs.environment.{name}"
        for name in ("primitive_humanoid", "varied_humanoid", "online", "vector", "options")
    ),
    *(f"mplearn_envs.skills.{name}" for name in ("feasibility", "repertoire", "skills")),
    *(
        f"mplearn_envs.execution.{name}"
        for name in ("bodies", "sensors", "simulation", "tracking_report")
    ),
    "mplearn_agents.walk",
)


def on_page_markdown(markdown: str, page: Any, config: Any, **_: Any) -> str:
    """Draw the rooms from what they import, where the page of the structure wants it."""
    if page.file.src_uri != "structure.md":
        return markdown
    root = Path(config["config_file_path"]).parent
    drawn = [sys.executable, "scripts/structure.py", "--svg", "-"]
    svg = subprocess.run(drawn, cwd=root, check=True, capture_output=True, text=True).stdout
    return markdown.replace("<!-- rooms -->", svg)


def on_page_content(content: str, page: Any, **_: Any) -> str:
    """Replace each formula by MathML, which browsers draw without a script; link the sources."""
    up = "../" * page.url.count("/")
    linked = rf'[<a href="{up}references.html">\1</a>'
    return SOURCE.sub(linked, FORMULA.sub(_mathml, content))


def _mathml(found: re.Match[str]) -> str:
    display = "inline" if found[2] == "(" else "block"
    return convert(html.unescape(found[3]), display=display)


def on_files(files: Files, config: Any) -> Files:
    """Add a page of the reference for each room that has public names."""
    root = Path(config["config_file_path"]).parent
    pages = {name: f"# {name}\n\n::: {name}\n" for name in MODULES}
    for package, folder in PACKAGES.items():
        for init in sorted((root / folder).glob("*/**/__init__.py")):
            room = ".".join((package, *init.parent.relative_to(root / folder).parts))
            if names := public_names(init):
                parts = (f"::: {room}.{name}" for name in names)
                pages[room] = "\n\n".join((f"# {room}", *parts)) + "\n"
    for name, page in pages.items():
        files.append(File.generated(config, f"reference/{name}.md", content=page))
    config["nav"].append({"Reference": [f"reference/{name}.md" for name in sorted(pages)]})
    return files


def public_names(init: Path) -> list[str]:
    """Return the names that a room's door re-exports: ``from .x import Y as Y``."""
    found = re.findall(r"\b([A-Za-z]\w*) as \1\b", init.read_text(encoding="utf-8"))
    return sorted(set(found), key=found.index)
