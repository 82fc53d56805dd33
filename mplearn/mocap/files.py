"""Files as they come: plain or gzipped, bytes or text, and the error that names them."""

from __future__ import annotations

import gzip
import re
import zlib
from pathlib import Path

from ..errors import RecordingError


def suffix(path: Path) -> str:
    """Return the suffix that names the format, lower case: ``86_01.amc.gz`` -> ``.amc``."""
    return Path(_ungzipped(path)).suffix.lower()


def stem(path: Path) -> str:
    """Return the name without the suffixes: ``86_01.amc.gz`` -> ``86_01``."""
    return Path(_ungzipped(path)).stem


def cmu_subject(name: str) -> str:
    """Return the subject of a name like CMU's, ``86_01`` -> ``86``; empty for other names."""
    match = re.fullmatch(r"(\d+)_\d+", name)
    return match[1] if match else ""


def bad_file(path: Path, found: str, expected: str) -> RecordingError:
    """Return the error of a file that does not hold what its format promises."""
    return RecordingError(f"{path}: {found}; expected {expected}")


def read_bytes(path: Path) -> bytes:
    """Return the content of a file, unpacked where its name ends in ``.gz``.

    Raises:
        RecordingError: The file is missing, empty, unreadable, or a damaged gzip file.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise bad_file(path, f"cannot be read ({error.strerror})", "a readable file") from error
    if path.suffix.lower() == ".gz":
        try:
            data = gzip.decompress(data)
        except (OSError, EOFError, zlib.error) as error:
            raise bad_file(path, f"damaged ({error})", "a whole gzip file") from error
    if not data.strip():
        raise bad_file(path, "the file is empty", f"a {suffix(path)} recording")
    return data


def read_text(path: Path) -> str:
    """Return the content of a text file; older tools write Latin-1, newer ones UTF-8.

    Raises:
        RecordingError: As `read_bytes`, or the file is not text.
    """
    data = read_bytes(path)
    if b"\0" in data:
        raise bad_file(path, "the file is binary", f"the text of a {suffix(path)} recording")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def _ungzipped(path: Path) -> str:
    return path.name[:-3] if path.name.lower().endswith(".gz") else path.name
