"""The door: a path to a recording, whatever its format."""

from __future__ import annotations

import os
import warnings
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple, TypeVar

import numpy as np

from ..errors import RecordingError, RecordingWarning
from ..option_names import option
from ..recording import ReadReport, Recording
from .files import (
    bad_file,
    contents,
    is_file,
    is_folder,
    may_be_read,
    older_copies,
    size_of,
    stem,
    within,
)
from .folders import folders_in, folders_of_recordings, no_files, passed_over
from .keypoints.animals import AnimalReader
from .keypoints.hdf5 import hdf5_readers
from .keypoints.tables import DeepLabCutReader, KeyPointsReader, SLEAPReader
from .labels import labels_beside
from .markers.c3d import C3DReader
from .markers.csv_table import CSVReader
from .markers.motive import MotiveReader
from .markers.nexus import NexusReader
from .markers.qualisys import QualisysReader
from .markers.trc import TRCReader
from .markers.ui_prmd import UIPRMDReader
from .markers.xdf import XDFReader
from .packed.archives import archive_kind, archive_of, is_archive
from .people import each_person
from .placing.handedness import right_handed
from .placing.level import leveled, told_of_lean, turn_to_level
from .reader import Hints, Reader, joined
from .registry import reader_for, reader_of, register_reader, suffixes
from .resample import resample
from .skeletons.amc import AMCReader
from .skeletons.bvh import BVHReader
from .skeletons.g1_csv import G1ArrayReader, G1CSVReader
from .skeletons.joint_arrays import JointArrayReader
from .skeletons.mvnx import MVNXReader
from .skeletons.opensim import OpenSimReader
from .skeletons.smpl import SMPLReader
from .skeletons.theia import TheiaReader

# the most general first: the latest is asked first
for _reader in (
    CSVReader(),
    G1CSVReader(),
    NexusReader(),
    QualisysReader(),
    MotiveReader(),
    TRCReader(),
    OpenSimReader(),
    BVHReader(),
    AMCReader(),
    MVNXReader(),
    SMPLReader(),
    JointArrayReader(),
    G1ArrayReader(),
    C3DReader(),
    TheiaReader(),
    XDFReader(),
    UIPRMDReader(),
    KeyPointsReader(),
    DeepLabCutReader(),
    SLEAPReader(),
    *hdf5_readers(),
):
    register_reader(_reader)

_Read = TypeVar("_Read")


class NothingReadableError(RecordingError):
    """A folder holds no file that any reader takes."""


def open_recording(
    path: str | os.PathLike[str],
    *,
    take: str | None = None,
    rate_hz: float | None = None,
    positions: bool = False,
    hints: Hints | None = None,
) -> Recording:
    r"""Read one recording.

    Args:
        path: A file of any format that a reader is registered for, plain or packed (gzip, bzip2,
            xz), a folder, an archive (zip, tar), or what is in one: ``"session.zip/one.bvh"``.
        take: Which take of a folder or archive: UI-PRMD's ``"m01_s01"``, a file's name without its
            suffix, or with it where two formats hold the same take.
        rate_hz: Resample to this rate [1/s]; by default the file's own.
        positions: For skeletal files (AMC, BVH): joint-centre positions as markers [m] instead of
            joint angles [rad].
        hints: What the file does not say about itself.

    Returns:
        Markers [m] (z up, NaN where occluded) or angles [rad], with the labels that are known, of
        all people who are in it (`each_person` tells them apart), or the animal seen most. Its
        ``report`` tells how the file was read; what contradicts itself or is in doubt is also
        issued as a `RecordingWarning`.

    Raises:
        RecordingError: The path holds no recording, several takes and none is named, or a file does
            not hold what its format promises.
        InvalidValueError: A rate or a hint lies outside its range.

    Example:
        >>> from pathlib import Path
        >>> rows = "".join(f"{k / 100},0.0,0.0,{1.7 + 0.001 * (k % 5)}\n" for k in range(50))
        >>> _ = Path("walk.csv").write_text("time_s,head.x,head.y,head.z\n" + rows)
        >>> take = open_recording("walk.csv", hints=Hints(unit_m=1.0, up_axis="z"))
        >>> len(take), take.rate_hz, take.channels
        (50, 100.0, ('head.x', 'head.y', 'head.z'))
    """
    takes = _takes(Path(path))
    if take is None and len(takes) > 1:
        at = Path(path)
        what = f"it is a {archive_kind(at)} archive of " if is_archive(at) else ""
        raise RecordingError(
            f"{path}: {what}{len(takes)} takes; expected take= one of {_listed(takes)}"
        )
    name = next(iter(takes)) if take is None else take
    if name not in takes:
        raise RecordingError(f"{path}: no take {take!r}; expected one of {_listed(takes)}")
    recording = _read(takes[name], rate_hz, positions, hints)
    _say(recording, takes[name].files[0])
    return recording


def open_recordings(
    path: str | os.PathLike[str],
    *,
    rate_hz: float | None = None,
    positions: bool = False,
    hints: Hints | None = None,
    strict: bool = False,
) -> tuple[Recording, ...]:
    r"""Read all takes of a folder, in order of their names, or one file.

    A take of several people becomes one for each (`each_person`), one of several animals one for
    each that is seen at least half as often as the one seen most.

    Args:
        path: As for `open_recording`, as the others.
        rate_hz: Resample to this rate [1/s].
        positions: Joint-centre positions instead of joint angles.
        hints: What the files do not say about themselves.
        strict: Whether a take that cannot be read is an error; otherwise it is left out, with a
            `RecordingWarning`, as long as another one can be read.

    Example:
        >>> from pathlib import Path
        >>> rows = "".join(f"{k / 50},{0.01 * k}\n" for k in range(100))
        >>> Path("takes").mkdir(exist_ok=True)
        >>> for take in ("one", "two"):
        ...     _ = Path(f"takes/{take}.csv").write_text("time_s,elbow\n" + rows)
        >>> [recording.name for recording in open_recordings("takes")]
        ['one', 'two']
    """
    takes = open_takes(path, rate_hz=rate_hz, positions=positions, hints=hints, strict=strict)
    for error in takes.unreadable.values():
        warnings.warn(f"left out: {error}", RecordingWarning, stacklevel=2)
    for recording in takes.recordings:
        _say(recording, Path(path))
    return takes.recordings


@dataclass(frozen=True)
class Takes:
    r"""The takes of a folder.

    Attributes:
        recordings: Those that can be read, in order of their names.
        unreadable: Why not, by name, for the others.
        folders: Names of the folders in it that may hold recordings, too, and are not looked into;
            `find_takes` does.
        passed_over: Names of the files in it that are called as key points of animals may be, and
            hold none.

    Example:
        >>> from pathlib import Path
        >>> Path("mixed").mkdir(exist_ok=True)
        >>> rows = "".join(f"{k / 50:.2f},{k % 7}\n" for k in range(100))
        >>> _ = Path("mixed", "swing.csv").write_text("time_s,elbow\n" + rows)
        >>> _ = Path("mixed", "torn.csv").write_text("time_s,elbow\n0.1,up\n")
        >>> takes = open_takes("mixed")
        >>> [take.name for take in takes.recordings], list(takes.unreadable)
        (['swing'], ['torn'])
    """

    recordings: tuple[Recording, ...]
    unreadable: Mapping[str, RecordingError]
    folders: tuple[str, ...] = ()
    passed_over: tuple[str, ...] = ()


def open_takes(
    path: str | os.PathLike[str],
    *,
    rate_hz: float | None = None,
    positions: bool = False,
    hints: Hints | None = None,
    strict: bool = False,
    through: Callable[[Collection[str]], Iterable[str]] = iter,
) -> Takes:
    r"""Read all takes as `open_recordings` does, and tell which cannot be read, without warnings.

    Args:
        path: As for `open_recordings`, as the others.
        rate_hz: Resample to this rate [1/s].
        positions: Joint-centre positions instead of joint angles.
        hints: What the files do not say about themselves.
        strict: Whether a take that cannot be read is an error.
        through: Passes on the names of all takes, in order, each as it is its turn to be read: a
            bar of progress.

    Example:
        >>> from pathlib import Path
        >>> Path("swings").mkdir(exist_ok=True)
        >>> rows = "".join(f"{k / 50:.2f},{k % 7}\n" for k in range(100))
        >>> for name in ("slow.csv", "quick.csv"):
        ...     _ = Path("swings", name).write_text("time_s,elbow\n" + rows)
        >>> [(take.name, take.rate_hz) for take in open_takes("swings").recordings]
        [('quick', 50.0), ('slow', 50.0)]
    """
    found: list[Recording] = []
    takes, unreadable = _found_in(Path(path))
    if unreadable and (strict or not takes):
        raise next(iter(unreadable.values()))
    for name in through(takes):
        try:
            found.extend(_read_each(takes[name], rate_hz, positions, hints))
        except RecordingError as error:
            if strict or len(takes) == 1:
                raise
            unreadable[name] = error
    if not found:
        first = next(iter(unreadable.values()))
        raise RecordingError(f"none of {len(takes)} takes can be read; the first: {first}")
    return Takes(
        tuple(found),
        MappingProxyType(unreadable),
        folders_of_recordings(Path(path)),
        passed_over(Path(path)),
    )


def take_names(path: str | os.PathLike[str]) -> tuple[str, ...]:
    """Return the names of the takes that a folder holds, without reading them.

    Raises:
        RecordingError: The path holds no recording.

    Example:
        >>> table = os.linesep.join(("time,C7.x,C7.y,C7.z", "0.00,0,0,1.4", "0.01,0,0,1.4"))
        >>> written = [Path(name).write_text(table) for name in ("bow.csv", "walk.csv")]
        >>> take_names(".")
        ('bow', 'walk')
    """
    return tuple(_takes(Path(path)))


@dataclass(frozen=True)
class TakeFiles:
    r"""A take that lies in files, and is not read yet.

    Attributes:
        name: What it is called, with the folders that it lies in.
        person: Who moves, as far as names of files and folders tell; empty where they do not.
        files: Its files, in order.
        reader: What reads them.

    Example:
        >>> from pathlib import Path
        >>> Path("walks", "anna").mkdir(parents=True, exist_ok=True)
        >>> rows = "".join(f"{k / 50:.2f},{k % 7}\n" for k in range(100))
        >>> _ = Path("walks", "anna", "slow.csv").write_text("time_s,elbow\n" + rows)
        >>> (take,) = find_takes("walks").takes
        >>> take.name, take.person, len(take.read()[0])
        ('anna/slow', 'anna', 100)
    """

    name: str
    person: str
    files: tuple[Path, ...]
    reader: Reader

    def read(self, *, positions: bool = False, hints: Hints | None = None) -> tuple[Recording, ...]:
        """Return a recording of each person in it; see `open_recordings`.

        Raises:
            RecordingError: The files do not hold what their format promises.
        """
        return _read_each(self, None, positions, hints)


class FoundTakes(NamedTuple):
    r"""The takes of a folder and of those in it, not read yet.

    Attributes:
        takes: In order of their names.
        unreadable: Why not, by name, for folders whose takes cannot be told apart.

    Example:
        >>> from pathlib import Path
        >>> Path("bows").mkdir(exist_ok=True)
        >>> _ = Path("bows", "deep.csv").write_text("time_s,elbow\n0,0\n0.1,1\n")
        >>> found = find_takes("bows")
        >>> [take.name for take in found.takes], dict(found.unreadable)
        (['deep'], {})
    """

    takes: tuple[TakeFiles, ...]
    unreadable: Mapping[str, RecordingError]


def find_takes(path: str | os.PathLike[str]) -> FoundTakes:
    r"""Find the takes of a folder and of all folders in it, in order of their names.

    Nothing is read but what tells formats apart. Who moves is told by a take's name, as in UI-PRMD
    and CMU's motions, or else by the first folder that it lies in.

    Raises:
        RecordingError: The path holds no recording.

    Example:
        >>> from pathlib import Path
        >>> for person in ("anna", "ben"):
        ...     Path("walks", person).mkdir(parents=True, exist_ok=True)
        ...     _ = Path("walks", person, "slow.csv").write_text("time_s,elbow\n0,0\n0.1,1\n")
        >>> [(take.name, take.person) for take in find_takes("walks").takes]
        [('anna/slow', 'anna'), ('ben/slow', 'ben')]
    """
    path = Path(path)
    folders, closed = folders_in(path) if is_folder(path) else ((path,), {})
    found: list[TakeFiles] = []
    unreadable = {_named(path, folder): error for folder, error in closed.items()}
    for folder in folders:
        parts = folder.relative_to(path).parts
        try:
            takes, problems = _found_in(folder)
        except NothingReadableError:
            continue
        except RecordingError as error:
            unreadable[_named(path, folder)] = error
            continue
        unreadable |= {"/".join((*parts, name)): error for name, error in problems.items()}
        for name, take in takes.items():
            whole = "/".join((*parts, name))
            folder_of = parts[0] if parts else stem(Path(whole.split("/")[0]))  # or an archive
            person = take.person or (folder_of if "/" in whole else "")
            found.append(replace(take, name=whole, person=person))
    if not found:
        raise next(iter(unreadable.values()), _nothing_readable(path))
    return FoundTakes(tuple(sorted(found, key=lambda take: take.name)), unreadable)


def _named(path: Path, folder: Path) -> str:
    """Return what a folder in a path is called."""
    return "/".join(folder.relative_to(path).parts) or str(path)


def _nothing_readable(path: Path) -> RecordingError:
    what = "an archive" if is_archive(path) else "a folder"
    found = f"{path}: {what} with nothing readable; expected files named {', '.join(suffixes())}"
    if inside := folders_of_recordings(path):
        few = ", ".join(inside[:3]) + (", ..." if len(inside) > 3 else "")
        found = f"{found} (what is in folders of it, {few}, is found by {option('jobs')})"
    return NothingReadableError(found)


def _takes(path: Path) -> dict[str, TakeFiles]:
    """Return the files of each take, by name."""
    takes, unreadable = _found_in(path)
    if not takes:
        first = next(iter(unreadable.values()))
        raise NothingReadableError(f"{_nothing_readable(path)}; there is {first}")
    return takes


def _found_in(path: Path) -> tuple[dict[str, TakeFiles], dict[str, RecordingError]]:
    """Return the files of each take, and why something is none, by name; not both are empty."""
    if is_file(path):
        if is_archive(path):
            return _found_in_archive(path)
        name, reader = stem(path), reader_for(path)
        return {name: TakeFiles(name, reader.person(name), (path,), reader)}, {}
    if not is_folder(path):
        raise bad_file(path, "no such file or folder", "a recording or a folder of recordings")
    return _found_in_folder(path)


def _found_in_folder(path: Path) -> tuple[dict[str, TakeFiles], dict[str, RecordingError]]:
    """Return the takes in a folder, an archive or a folder in one, and not in folders in it."""
    files: dict[Reader, list[Path]] = {}
    try:
        inside = within(path)
    except OSError as error:
        raise bad_file(path, f"{error.strerror}", "a folder that may be read") from error
    unreadable = no_files(path)
    named: list[tuple[str, TakeFiles]] = []  # and what it is called where its name is not its own
    for file in inside:
        if is_archive(file):
            try:
                takes, problems = _found_in_archive(file, beside=True)
            except RecordingError as error:
                unreadable[file.name] = error
                continue
            inner = f"{file.name}/"
            unreadable |= {inner + name: error for name, error in problems.items()}
            if len(takes) == 1:
                named += [(file.name, take) for take in takes.values()]
            else:
                named += [(inner + n, replace(t, name=inner + n)) for n, t in takes.items()]
        elif may_be_read(file) and (fitting := reader_of(file)) is not None:
            files.setdefault(fitting, []).append(file)
    _leave_what_is_a_table(files)
    for reader, group in files.items():
        for name, taken in reader.takes(group).items():
            named.append((taken[0].name, TakeFiles(name, reader.person(name), taken, reader)))
    if not named and not unreadable:
        raise _nothing_readable(path)
    times = Counter(take.name for _, take in named)
    takes = {t.name if times[t.name] == 1 else whole: t for whole, t in named}
    return {name: replace(takes[name], name=name) for name in sorted(takes)}, unreadable


def _leave_what_is_a_table(files: Mapping[Reader, list[Path]]) -> None:
    """Leave out HDF5 of key points that the program has also written as a table beside it."""
    both = {r: group for r, group in files.items() if isinstance(r, AnimalReader)}
    tables = {stem(file) for r, group in both.items() if ".csv" in r.suffixes for file in group}
    for reader, group in both.items():
        if ".csv" not in reader.suffixes:
            group[:] = [file for file in group if stem(file) not in tables]


def _found_in_archive(
    path: Path, *, beside: bool = False
) -> tuple[dict[str, TakeFiles], dict[str, RecordingError]]:
    """Return the takes in an archive as those of a folder; one alone is called as the archive.

    Args:
        path: The archive.
        beside: Whether it is refused where its files lie unpacked beside it, as they are found too.
    """
    files, called = contents(path), stem(path)
    if beside and files and all(_lies_unpacked(file, path, len(files) > 1) for file in files):
        raise bad_file(path, "what is in it lies unpacked beside it", "each take once")
    if len(files) == 1:
        reader = reader_for(files[0])
        return {called: TakeFiles(called, reader.person(called), (files[0],), reader)}, {}
    takes: dict[str, TakeFiles] = {}
    unreadable: dict[str, RecordingError] = {}
    for folder in sorted({file.parent for file in files}):
        inner = "".join(f"{part}/" for part in folder.relative_to(path).parts)
        try:
            found, problems = _found_in_folder(folder)
        except NothingReadableError:
            continue
        except RecordingError as error:
            unreadable[inner or called] = error
            continue
        takes |= {inner + name: take for name, take in found.items()}
        unreadable |= {inner + name: error for name, error in problems.items()}
    if not takes and not unreadable:
        raise _nothing_readable(path)
    if len(takes) == 1:
        takes = {called: next(iter(takes.values()))}
    return {name: replace(takes[name], name=name) for name in sorted(takes)}, unreadable


def _lies_unpacked(file: Path, archive: Path, several: bool) -> bool:
    """Whether a file in an archive also lies in its folder, or in one that is called like it."""
    if not several and stem(file) != stem(archive):
        return False
    at = archive.parent, archive.parent / stem(archive)
    return any(size_of(each / file.relative_to(archive)) == size_of(file) for each in at)


def _read(
    take: TakeFiles, rate_hz: float | None, positions: bool, hints: Hints | None
) -> Recording:
    parts = [
        _part(take, file, _read_by(take.reader.read, file, hints, positions), hints)
        for file in take.files
    ]
    return _whole(take, parts, rate_hz, hints)


def _read_each(
    take: TakeFiles, rate_hz: float | None, positions: bool, hints: Hints | None
) -> tuple[Recording, ...]:
    """Return a recording of each who is in a take."""
    if len(take.files) > 1:
        return each_person(_read(take, rate_hz, positions, hints))
    (file,) = take.files
    found = _read_by(take.reader.read_each, file, hints, positions)
    if not isinstance(found, tuple) or not found:
        what = "()" if isinstance(found, tuple) else f"a value of type {type(found).__name__}"
        name = type(take.reader).__name__
        raise RecordingError(f"{file}: {name}.read_each returned {what}, not a tuple of recordings")
    apart = [_whole(take, [_part(take, file, one, hints)], rate_hz, hints) for one in found]
    return tuple(each for one in apart for each in each_person(one))


def _part(take: TakeFiles, file: Path, read: object, hints: Hints | None) -> Recording:
    """Return what was read of a file, with what is known of it besides."""
    part = _recording(read, file, take.reader)
    if not part.labels:
        part = replace(part, labels=labels_beside(file, part))
    if part.report is None:
        part = replace(part, report=ReadReport(take.reader.format, part.rate_hz))
    if hints is not None and hints.mirrored:
        part = right_handed(file, part)
    if archive_of(file) is not None:  # of which folders may hold files of one name
        part = replace(part, name=take.name)
    if part.report and (older := older_copies(file)):
        held = "an older copy" if older == 1 else f"{older} older copies"
        said = f"the archive holds {held} of {file.name}, passed over"
        part = replace(part, report=replace(part.report, notes=(*part.report.notes, said)))
    return part


def _whole(
    take: TakeFiles, parts: Sequence[Recording], rate_hz: float | None, hints: Hints | None
) -> Recording:
    recording = parts[0] if len(parts) == 1 else joined(take.name, parts)
    if hints is not None and hints.level:
        recording = leveled(recording, turn_to_level(take.files[0], recording))
    else:
        recording = told_of_lean(recording)
    return recording if rate_hz is None else resample(recording, rate_hz)


def _read_by(read: Callable[..., _Read], file: Path, hints: Hints | None, positions: bool) -> _Read:
    try:
        # numbers that no one measured overflow: what comes of them is checked, and refused
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            return read(file, hints or Hints(), positions=positions)
    except NotADirectoryError as error:
        reader = type(getattr(read, "__self__", read)).__name__
        own = f"{reader} opens files itself, and cannot open one in an archive"
        raise bad_file(file, own, "the archive unpacked, or a reader by read_bytes") from error


def _recording(read: object, file: Path, reader: Reader) -> Recording:
    """Return what a reader has read, which may be someone else's."""
    if isinstance(read, Recording):
        return read
    kind, name = type(read).__name__, type(reader).__name__
    raise RecordingError(f"{file}: {name}.read returned a value of type {kind}, not a Recording")


def _say(recording: Recording, path: Path) -> None:
    for text in recording.report.warnings if recording.report else ():
        warnings.warn(f"{path}: {recording.name}: {text}", RecordingWarning, stacklevel=3)


def _listed(takes: Mapping[str, object]) -> str:
    names = list(takes)
    return ", ".join(names[:60]) + (", ..." if len(names) > 60 else "")
