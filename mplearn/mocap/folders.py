"""Folders of recordings: which there are, each once, and what in them is no file to be read."""

from __future__ import annotations

import os
from pathlib import Path
from typing import NamedTuple

from ..errors import RecordingError
from .files import bad_file, is_file, is_folder, may_be_read, read_bytes, stem, suffix, within
from .packed.archives import is_archive, named_archive
from .registry import holds_other_arrays, instead_of, suffixes


class FoundFolders(NamedTuple):
    """A folder, and all folders in it.

    Attributes:
        folders: In order, each under one name.
        closed: Why not, for those that cannot be looked into.
    """

    folders: tuple[Path, ...]
    closed: dict[Path, RecordingError]


def folders_in(path: Path) -> FoundFolders:
    """Find a folder and all in it, those that links lead to, too.

    To where several ways lead it is found once: where it lies, or else through the first link, by
    name; so links that lead back to a folder above are no loops, and nothing is learned twice.

    Example:
        >>> for name in ("walks/anna", "walks/ben"):
        ...     Path(name).mkdir(parents=True, exist_ok=True)
        >>> [folder.as_posix() for folder in folders_in(Path("walks")).folders]
        ['walks', 'walks/anna', 'walks/ben']
    """
    found: list[Path] = []
    closed: dict[Path, RecordingError] = {}
    seen: set[tuple[int, int]] = set()

    def refuse(error: OSError) -> None:
        folder = Path(error.filename)
        closed[folder] = bad_file(folder, f"{error.strerror}", "a folder that may be read")

    starts = [path]
    while starts:
        links: list[Path] = []
        for start in sorted(starts):
            for at, inside, _ in os.walk(start, onerror=refuse):
                known = Path(at).stat()
                if (known.st_dev, known.st_ino) in seen:
                    inside.clear()
                    continue
                seen.add((known.st_dev, known.st_ino))
                found.append(Path(at))
                linked = [name for name in inside if _is_link(Path(at, name))]
                links += [Path(at, name) for name in linked]
                inside[:] = [name for name in inside if name not in linked]
        starts = links
    return FoundFolders(tuple(sorted(found)), closed)


def folders_of_recordings(path: Path) -> tuple[str, ...]:
    """Return the names of the folders in a folder in which, how deep ever, recordings may lie.

    Example:
        >>> Path("takes", "anna").mkdir(parents=True, exist_ok=True)
        >>> Path("takes", "notes").mkdir(exist_ok=True)
        >>> _ = Path("takes", "anna", "walk.bvh").write_text("HIERARCHY")
        >>> folders_of_recordings(Path("takes"))
        ('anna',)
    """
    folders: list[str]
    _, folders, _ = next(os.walk(path), ("", [], []))  # nothing where it may not be read
    own = (name for name in sorted(folders) if not name.startswith("."))
    return tuple(name for name in own if _holds_recordings(path / name))


def _holds_recordings(folder: Path) -> bool:
    known = suffixes()
    return any(
        suffix(Path(name)) in known or named_archive(Path(name))
        for _, _, names in os.walk(folder)
        for name in names
    )


def passed_over(folder: Path) -> tuple[str, ...]:
    """Return the names of the files of arrays in a folder that are none of key points.

    Example:
        >>> import h5py
        >>> Path("mixed").mkdir(exist_ok=True)
        >>> with h5py.File("mixed/weather.h5", "w") as file:
        ...     file["temperatures"] = [12.5, 13.0]
        >>> passed_over(Path("mixed"))
        ('weather.h5',)
    """
    if not is_folder(folder):
        return ()
    return tuple(each.name for each in within(folder) if holds_other_arrays(each))


def no_files(folder: Path) -> dict[str, RecordingError]:
    """Return why not, by name, for what a folder holds that is called as recordings are.

    Links that lead nowhere, pipes and devices, files that may not be read, what is called as
    archives are and is none, or lies in one, and what programs also write as a table that is not
    beside it.

    Example:
        >>> import os
        >>> Path("linked").mkdir(exist_ok=True)
        >>> Path("linked", "walk.csv").unlink(missing_ok=True)
        >>> os.symlink("elsewhere.csv", Path("linked", "walk.csv"))
        >>> print(no_files(Path("linked"))["walk.csv"])
        linked/walk.csv: a link to elsewhere.csv, where nothing is; expected a recording
    """
    found = {}
    inside = within(folder)
    tables = [each.name for each in inside if suffix(each) in suffixes()]
    for each in inside:
        if named_archive(each) and not is_archive(each) and may_be_read(each):
            found[each.name] = _no_archive(each)
            continue
        if (instead := instead_of(each)) and is_file(each):
            beside = any(name.startswith(stem(each)) for name in tables)
            if not (beside or holds_other_arrays(each)):
                found[each.name] = bad_file(each, "not read", instead)
            continue
        if suffix(each) in suffixes() or named_archive(each):
            problem = _problem(each)
        else:  # what a name without a suffix links to may be a folder
            problem = "" if suffix(each) or not _is_link(each) else _problem(each)
        if problem:
            found[each.name] = bad_file(each, problem, "a recording")
    return found


def _no_archive(path: Path) -> RecordingError:
    """Return why what is called as archives are is not looked into."""
    try:
        read_bytes(path)
    except RecordingError as error:  # as a page of the web that was saved instead
        return error
    return bad_file(path, "it is no archive", "one, or a recording called as those of its format")


def _problem(path: Path) -> str:
    """Return why a path cannot be read; empty where it can, or is a folder."""
    if is_folder(path):
        return ""
    if is_file(path):
        return "" if may_be_read(path) else "a file that may not be read"
    if _is_link(path):
        return f"a link to {path.readlink()}, where nothing is"
    if not os.path.lexists(path):  # in a folder whose names may be read, and nothing else
        return "a file that may not be read"
    return "a pipe or a device"


def _is_link(path: Path) -> bool:
    """Say whether a path is a link; no where nobody may know."""
    return os.path.islink(path)  # noqa: PTH114 (`is_symlink` raises there, on Python 3.11)
