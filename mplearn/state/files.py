"""Files of plain values and arrays: a zip of one JSON header and the arrays it names.

No pickle, no code. ``header.json`` holds format, schema version, checksum and content; the bytes of
arrays are in ``arrays.bin`` (`packing`). A file of an older schema is brought up to date by the
migrations of its format.
"""

from __future__ import annotations

import hashlib
import struct
import zipfile
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..errors import MPLearnError, StateError
from ..writing import written_whole
from .packing import as_json, from_json, packed, unpacked

_MAX_BYTES = 1 << 30  # of the content of a file that claims to hold many times its own size
_DENSEST = 8  # times its size that a larger one may hold
_DAMAGED = (zipfile.BadZipFile, zlib.error, struct.error, EOFError, LookupError, ValueError)
SQLITE = b"SQLite format 3\0"  # how a database begins
_EPOCH = (1980, 1, 1, 0, 0, 0)  # a fixed date: equal contents are equal files


@dataclass(frozen=True)
class FileFormat:
    """A kind of file.

    Attributes:
        name: Stands in the header.
        noun: What a file holds, for messages: "library".
        error: The error that is raised.
        schema: Version of what is written.
        migrations: From the content of version n to that of n + 1, by n.
        compression: Level of the zip, 0 to 9.

    Example:
        >>> from pathlib import Path
        >>> from mplearn.errors import StateError
        >>> notes = FileFormat("my-notes", "notebook", StateError)
        >>> notes.write(Path("a.notes"), {"first": "shoes off"})
        >>> notes.read(Path("a.notes"))
        {'first': 'shoes off'}
    """

    name: str
    noun: str
    error: type[MPLearnError]
    schema: int = 1
    migrations: Mapping[int, Callable[[Any], Any]] = field(default_factory=dict)
    compression: int = 9

    def write(self, path: Path, content: Any) -> None:
        """Write plain values and arrays to a file, all of it or nothing.

        Raises:
            MPLearnError: Of the format's kind: the content holds something else, or the file cannot
                be written.
        """
        try:
            body, blob = packed(content)
        except StateError as error:
            raise self.error(f"cannot write {path}: {error}") from error
        header = {
            "format": self.name,
            "schema": self.schema,
            "sha256": checksum(body, blob),
            "content": body,
        }
        parts = {"header.json": as_json(header), "arrays.bin": blob}
        try:
            with written_whole(path) as file, zipfile.ZipFile(file, "w") as archive:
                for part, data in parts.items():
                    info = zipfile.ZipInfo(part, _EPOCH)
                    info.compress_type = zipfile.ZIP_DEFLATED
                    archive.writestr(info, data, compresslevel=self.compression)
        except OSError as error:
            raise self.error(f"cannot write {path}: {error.strerror}") from error

    def read(self, path: Path) -> Any:
        """Return what `write` wrote, as of the newest schema.

        Raises:
            MPLearnError: Of the format's kind: the file cannot be read, is damaged, foreign, or of
                a newer version.
        """
        try:
            header_bytes, blob = _parts(path)
        except FileNotFoundError:
            raise self.error(f"there is no file {path}") from None
        except _DAMAGED as e:
            raise self.error(f"{path} is damaged, or not an mplearn {self.noun}: {e}") from e
        except (NotImplementedError, RuntimeError, OverflowError, OSError) as error:
            raise self.error(f"{path} cannot be read: {error}") from error
        try:
            header = from_json(header_bytes)
        except StateError as error:
            raise self.error(f"{path} is damaged: its header {error}") from error
        if not isinstance(header, dict) or header.get("format") != self.name:
            raise self.error(f"{path} is not an mplearn {self.noun}")
        schema = header.get("schema")
        if type(schema) is not int or schema < 1:
            raise self.error(f"{path} is damaged: its schema is {schema!r}")
        if schema > self.schema:
            raise self.error(
                f"{path} was written by a newer mplearn (schema {schema}); "
                f"this one reads {self.schema}"
            )
        if checksum(header.get("content"), blob) != header.get("sha256"):
            raise self.error(f"{path} is damaged: its checksum does not match its content")
        try:
            content = unpacked(header["content"], blob)
        except StateError as error:
            raise self.error(f"{path} {error}") from error
        try:
            for version in range(schema, self.schema):
                content = self.migrations[version](content)
        except StateError as error:
            raise self.error(f"{path} cannot be brought up to date: {error}") from error
        except (ValueError, TypeError, LookupError, AttributeError) as error:
            raise self.error(f"{path} cannot be brought up to date: {error!r}") from error
        return content

    def digest(self, content: Any) -> str:
        """Return the hash of plain values and arrays, 64 hexadecimal digits."""
        return checksum(*packed(content))


def checksum(body: Any, blob: bytes) -> str:
    """Return the hash of packed content, 64 hexadecimal digits."""
    return hashlib.sha256(as_json(body) + b"\0" + blob).hexdigest()


def is_database(path: Path) -> bool:
    """Whether a file is a database, as a store is, by its first bytes.

    Example:
        >>> from pathlib import Path
        >>> is_database(Path("none.db"))
        False
    """
    if not path.is_file():  # a pipe would be waited for
        return False
    try:
        with path.open("rb") as file:
            return file.read(len(SQLITE)) == SQLITE
    except OSError:
        return False


def _parts(path: Path) -> tuple[bytes, bytes]:
    if path.exists() and not (path.is_file() or path.is_dir()):  # of which there is no end
        raise ValueError("it is a pipe or a device, no file")
    with zipfile.ZipFile(path) as archive:
        names = ("header.json", "arrays.bin")
        size = sum(archive.getinfo(name).file_size for name in names)
        most = max(_MAX_BYTES, _DENSEST * path.stat().st_size)
        if size > most:
            raise ValueError(f"its content claims {size} bytes, more than {most}")
        header, blob = (archive.read(name) for name in names)
    return header, blob
