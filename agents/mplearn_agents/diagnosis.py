"""What works in this installation, and what to do about the rest."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections import defaultdict
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path
from typing import Literal, NamedTuple

_PATIENCE_S = 60.0  # for a first picture
_PICTURE = (
    "import mujoco; r = mujoco.Renderer(mujoco.MjModel.from_xml_string('<mujoco/>')); r.render()"
)


class Finding(NamedTuple):
    """What was looked at.

    Attributes:
        what: The thing.
        state: "ok"; "missing": something optional is not there; "wrong": something needed fails.
        found: What was found.
        advice: What to do; empty where all is well.
    """

    what: str
    state: Literal["ok", "missing", "wrong"]
    found: str
    advice: str = ""


def diagnose() -> Iterator[Finding]:
    """Yield what was found, one thing after the other."""
    yield _python()
    yield from _packages()
    yield _rendering()
    yield _library()
    yield _cache()
    yield _data()


def _python() -> Finding:
    found = ".".join(map(str, sys.version_info[:3]))
    good = (3, 11) <= sys.version_info[:2] <= (3, 12)
    return Finding("python", "ok" if good else "wrong", found, "" if good else "use 3.11 or 3.12")


def _packages() -> Iterator[Finding]:
    """Compare what is installed with what mplearn asks for, extra by extra."""
    asked: dict[str, list[str]] = defaultdict(list)
    for line in requires("mplearn") or ():
        requirement, _, marker = line.partition(";")
        named = re.search(r"extra\s*==\s*['\"]([\w-]+)['\"]", marker)
        asked[named.group(1) if named else ""].append(requirement.strip())
    for extra, requirements in asked.items():
        missing, wrong, found = [], [], []
        for requirement in requirements:
            name = re.split(r"[\s\[<>=!~(]", requirement, maxsplit=1)[0]
            try:
                here = version(name)
            except PackageNotFoundError:
                missing.append(name)
                continue
            found.append(f"{name} {here}")
            if not _fits(here, requirement):
                wrong.append(f"{name} {here}, wanted {requirement}")
        what = f"extra {extra}" if extra else "packages"
        install = f"pip install 'mplearn[{extra}]'" if extra else "pip install mplearn"
        if wrong or (missing and not extra):
            yield Finding(what, "wrong", "; ".join(wrong + missing), install)
        elif missing:
            yield Finding(what, "missing", f"without {', '.join(missing)}", install)
        else:
            yield Finding(what, "ok", ", ".join(found))


def _fits(here: str, requirement: str) -> bool:
    """Tell whether a version is in a range of the form ``>=1.2,<3``."""
    for sign, bound in re.findall(r"(>=|<)\s*([\d.]+)", requirement):
        is_new = _numbers(here) >= _numbers(bound)
        if is_new != (sign == ">="):
            return False
    return True


def _numbers(text: str) -> tuple[int, ...]:
    found = re.match(r"[\d.]+", text)
    numbers = [int(part) for part in found.group().split(".") if part] if found else []
    return tuple(numbers + [0] * (4 - len(numbers)))


def _rendering() -> Finding:
    from mplearn_envs.rendering.backend import choose_backend

    advice = "install libegl1 and libgl1-mesa-dri, or libosmesa6; or set MUJOCO_GL=egl or osmesa"
    if not choose_backend():
        return Finding("rendering", "missing", "no off-screen renderer works", advice)
    try:
        done = subprocess.run(
            [sys.executable, "-c", _PICTURE],
            capture_output=True,
            text=True,
            timeout=_PATIENCE_S,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return Finding("rendering", "missing", f"no picture in {_PATIENCE_S:g} s", advice)
    backend = os.environ.get("MUJOCO_GL", "default")
    if done.returncode:
        last = (done.stderr.strip().splitlines() or ["it crashed"])[-1]
        return Finding("rendering", "missing", f"{backend}: {last[:100]}", advice)
    return Finding("rendering", "ok", f"MuJoCo draws off screen by {backend}")


def _library() -> Finding:
    from mplearn.errors import MPLearnError
    from mplearn_envs.data.library_source import LibrarySource

    try:
        library = LibrarySource(None).now()
    except MPLearnError as error:
        return Finding(
            "library", "wrong", str(error)[:100], "pip install --force-reinstall mplearn"
        )
    return Finding("library", "ok", f"the built-in one, {len(library)} primitives")


def _cache() -> Finding:
    import mplearn

    folder = Path(os.environ.get("NUMBA_CACHE_DIR") or Path(mplearn.__file__).parent)
    if os.access(folder, os.W_OK):
        return Finding("compiled kernels", "ok", f"kept in {folder}")
    advice = "set NUMBA_CACHE_DIR to a folder you may write to: each start compiles anew"
    return Finding("compiled kernels", "missing", f"{folder} cannot be written", advice)


def _data() -> Finding:
    folder = os.environ.get("MPLEARN_DATA")
    if folder is None:
        advice = "set MPLEARN_DATA to a folder of recordings, for tests and evaluations on people"
        return Finding("data", "missing", "MPLEARN_DATA is not set", advice)
    if not Path(folder).is_dir():
        return Finding("data", "missing", f"MPLEARN_DATA={folder} is no folder", "correct it")
    return Finding("data", "ok", folder)
