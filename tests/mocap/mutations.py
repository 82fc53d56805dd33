"""Files as they break: cut, mixed up, with numbers that no one measured."""

from __future__ import annotations

import gzip
import io
import re
import zipfile

import numpy as np

NUMBER = re.compile(rb"-?\d+(?:\.\d+)?")
WORD = re.compile(rb"[A-Za-z_#]+")
ODD = (
    *(b"0", b"-1", b"1", b"2", b"65536", b"2147483648", b"99999999999999999999", b"7" * 5000),
    *(b"1e308", b"-1e308", b"1e-320", b"nan", b"inf", b"-inf", b"", b"0.0000000001", b"1_0", b"x"),
    *("\u0663".encode(), b"1,5", b"0x10", b"1e5", b"3.5", b"--", b"NA", b"\0"),
)  # fmt: skip


def mutated(rng: np.random.Generator, data: bytes, other: bytes) -> bytes:
    """Return a file's content with a few changes.

    Args:
        rng: What is random.
        data: A valid file.
        other: Another one, pieces of which may get in.
    """
    if zipfile.is_zipfile(io.BytesIO(data)) and rng.random() < 0.7:
        return _repacked(rng, data, other)  # else checksums refuse what is changed
    for _ in range(int(rng.integers(1, 5))):
        data = _CHANGES[int(rng.integers(len(_CHANGES)))](rng, data, other)
        if not data:
            break
    return data


def _repacked(rng: np.random.Generator, data: bytes, other: bytes) -> bytes:
    """Return an archive in which one of the files, or its name, is changed."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    names = list(members)
    name = names[int(rng.integers(len(names)))]
    if rng.random() < 0.1:
        members[names[int(rng.integers(len(names)))]] = members[name]
    else:
        members[name] = mutated(rng, members[name], other)
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return stream.getvalue()


def _span(rng: np.random.Generator, data: bytes, longest: int = 200) -> tuple[int, int]:
    start = int(rng.integers(len(data) + 1))
    return start, min(len(data), start + int(rng.integers(longest)))


def _cut(rng: np.random.Generator, data: bytes, other: bytes) -> bytes:
    return data[: int(rng.integers(len(data) + 1))]


def _without(rng: np.random.Generator, data: bytes, other: bytes) -> bytes:
    a, b = _span(rng, data)
    return data[:a] + data[b:]


def _twice(rng: np.random.Generator, data: bytes, other: bytes) -> bytes:
    a, b = _span(rng, data)
    return data[:b] + data[a:b] * int(rng.integers(1, 30)) + data[b:]


def _bytes(rng: np.random.Generator, data: bytes, other: bytes) -> bytes:
    changed = bytearray(data)
    for _ in range(int(rng.integers(1, 8))):
        changed[int(rng.integers(len(changed)))] = int(rng.integers(256))
    return bytes(changed)


def _words_of_bytes(rng: np.random.Generator, data: bytes, other: bytes) -> bytes:
    """Change whole numbers of two or four bytes, as binary formats hold them."""
    changed = bytearray(data)
    at = int(rng.integers(min(len(changed), 2048)))
    for byte in (b"\xff\xff", b"\0\0", b"\x7f\x7f", b"\x80\0", b"\xff\xff\xff\x7f", b"\x01\0")[
        int(rng.integers(6))
    ]:
        if at < len(changed):
            changed[at] = byte
            at += 1
    return bytes(changed)


def _number(rng: np.random.Generator, data: bytes, other: bytes) -> bytes:
    return _replaced(rng, data, NUMBER, ODD[int(rng.integers(len(ODD)))])


def _word(rng: np.random.Generator, data: bytes, other: bytes) -> bytes:
    words = WORD.findall(other[:4000]) or [b"x"]
    return _replaced(rng, data, WORD, words[int(rng.integers(len(words)))])


def _replaced(
    rng: np.random.Generator, data: bytes, pattern: re.Pattern[bytes], new: bytes
) -> bytes:
    # mostly near the start, where headers are
    start = int(len(data) * rng.random() ** 3)
    match = pattern.search(data, start)
    return data if match is None else data[: match.start()] + new + data[match.end() :]


def _lines(rng: np.random.Generator, data: bytes, other: bytes) -> bytes:
    lines = data.split(b"\n")
    a, b = (int(i) for i in rng.integers(len(lines), size=2))
    kind = int(rng.integers(4))
    if kind == 0:
        lines[a], lines[b] = lines[b], lines[a]
    elif kind == 1:
        del lines[min(a, b) : max(a, b)]
    elif kind == 2:
        lines[a:a] = lines[b : b + 3]
    else:
        lines[a] = other.split(b"\n")[0][:2000]
    return b"\n".join(lines)


def _signs(rng: np.random.Generator, data: bytes, other: bytes) -> bytes:
    signs = (b",", b";", b"\t", b" ", b"\n", b"\r\n", b'"', b"{", b"}", b":", b".", b"=", b"<")
    old, new = (signs[int(i)] for i in rng.integers(len(signs), size=2))
    return data.replace(old, new, int(rng.integers(1, 50)))


def _mixed(rng: np.random.Generator, data: bytes, other: bytes) -> bytes:
    cut, from_ = int(rng.integers(len(data) + 1)), int(rng.integers(len(other) + 1))
    return data[:cut] + other[from_ : from_ + 3000]


def _encoded(rng: np.random.Generator, data: bytes, other: bytes) -> bytes:
    kind = int(rng.integers(3))
    if kind == 0:
        return b"\xef\xbb\xbf" + data
    if kind == 1:
        return data.decode("latin-1").encode("utf-16")
    return gzip.compress(data, 1)


_CHANGES = (
    *(_cut, _without, _twice, _bytes, _words_of_bytes, _number, _number, _word, _lines, _signs),
    *(_mixed, _encoded),
)  # fmt: skip
