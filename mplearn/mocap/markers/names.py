"""Names of markers as files have them: prefixed by a subject, doubled, or missing."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import takewhile
from pathlib import Path

from ...recording import IntArray
from ..files import bad_file
from ..findings import Findings

# how systems call trajectories that they could not identify
_UNIDENTIFIED = re.compile(
    r"[-*~?.]+\d*|un(?:labell?ed|named|ident(?:ified)?|known)(?![a-z]).*|uname\*?\d*|new[ _]\d+",
    re.I,
)
_SEPARATORS = ":|/"
WORD_MARKS = ":_.-/ "
"""What stands between the words of a label."""


def chosen_names(
    path: Path, labels: Sequence[str], seen: IntArray, findings: Findings
) -> tuple[list[int], tuple[str, ...]]:
    """Return which points of a file have a name to be known by, and these names.

    A subject's prefix falls away where there is only one. Points without a name, and trajectories
    that were not identified, are left out; of two with the same name the first one that was ever
    seen stays.

    Args:
        path: The file, for messages.
        labels: The points' names in the file, length M.
        seen: In how many frames each was seen, length M.
        findings: Where to tell what is left out.

    Raises:
        RecordingError: No point has a name.
    """
    labels = [label.strip() for label in labels]
    plain = without_prefix(labels)
    nameless = [i for i, name in enumerate(plain) if not name or _UNIDENTIFIED.fullmatch(name)]
    chosen: dict[str, int] = {}
    doubled: dict[str, int] = {}
    for i, name in enumerate(plain):
        if i in set(nameless):
            continue
        if name in chosen:
            doubled[name] = doubled.get(name, 1) + 1
            if not seen[chosen[name]] and seen[i]:
                chosen[name] = i
        else:
            chosen[name] = i
    if not chosen:
        raise bad_file(path, "no marker with a name", "at least one")
    if nameless:
        findings.leave_out(plain[i] or "(no name)" for i in nameless)
        findings.note(f"{_count(len(nameless), 'point')} without a name left out")
    if doubled:
        names = ", ".join(sorted(doubled)[:5])
        findings.leave_out(name for name, n in doubled.items() for _ in range(n - 1))
        findings.warn(f"the same name more than once: {names}; the first one is used")
    kept = sorted(chosen.values())
    return kept, tuple(plain[i] for i in kept)


def without_prefix(labels: Sequence[str]) -> list[str]:
    """Return names without the subject's, ``Anna:LASI`` -> ``LASI``, if there is one subject."""
    prefixes = {_split(label)[0] for label in labels if label}
    prefixes.discard("")
    if len(prefixes) > 1:
        return list(labels)
    return [_split(label)[1] for label in labels]


def shared_start(labels: Sequence[str]) -> str:
    """Return what all labels begin with, up to a mark between words: ``Anna_`` of ``Anna_LASI``.

    Example:
        >>> shared_start(["body_0_nose", "body_1_nose"]), shared_start(["LASI", "LPSI"])
        ('body_', '')
    """
    if len(labels) < 2:
        return ""
    pairs = takewhile(lambda pair: pair[0] == pair[1], zip(min(labels), max(labels), strict=False))
    shared = "".join(letter for letter, _ in pairs)
    return shared[: max(shared.rfind(mark) for mark in WORD_MARKS) + 1]


def _split(label: str) -> tuple[str, str]:
    at = max(label.rfind(separator) for separator in _SEPARATORS)
    return label[: max(at, 0)].strip(), label[at + 1 :].strip()


def _count(number: int, what: str) -> str:
    return f"{number} {what}" + ("" if number == 1 else "s")
