"""The part of a BVH file before ``MOTION``: joints, offsets and channels."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ...files import bad_file
from ...findings import Findings
from ..kinematics import Joint
from ..skeletal import Column
from .numbers import missing_or_number, split_glued

_WORD = re.compile(r"[{}]|[^\s{}]+")
_KIND = "(rotation|rot|position|pos|translation)"
_CHANNEL = re.compile(rf"([xyz])_?{_KIND}|{_KIND}_?([xyz])|([rt])([xyz])")
_REMARK = re.compile(r"^[ \t]*(?:#|//).*$", re.MULTILINE)
_KEYWORDS = ("ROOT", "JOINT", "END", "ENDSITE", "END_SITE", "OFFSET", "CHANNELS", "{", "}")


def parse_hierarchy(
    path: Path, text: str, findings: Findings
) -> tuple[tuple[Joint, ...], tuple[Column, ...]]:
    """Return the joints, parents first, in the file's unit, and what the motion's columns mean.

    Raises:
        RecordingError: The text is not a hierarchy.
    """
    parser = _Parser(path, _WORD.findall(_REMARK.sub("", text)), findings)
    parser.parse()
    names, renamed = _distinct(parser.joints)
    if renamed:
        findings.warn(f"names that repeat are numbered: {', '.join(renamed[:5])}")
    roots = [name for name, joint in zip(names, parser.joints, strict=True) if joint.parent < 0]
    if len(roots) > 1:
        findings.note(f"{len(roots)} trees of joints: {', '.join(roots[:5])}")
    joints, columns = [], []
    for name, joint in zip(names, parser.joints, strict=True):
        columns += [(at, replace(column, joint=name)) for at, column in joint.channels]
        joints.append(
            Joint(
                name,
                joint.parent,
                np.array(joint.offset),
                tuple((np.eye(3)[c.axis], at) for at, c in joint.channels if c.rotates),
                tuple((c.axis, at) for at, c in joint.channels if not c.rotates),
                is_end=joint.is_end,
            )
        )
    columns.sort(key=lambda item: item[0])
    return tuple(joints), tuple(column for _, column in columns)


def _distinct(joints: list[_Open]) -> tuple[list[str], list[str]]:
    """Return a name for each joint, repeated ones numbered, and those of the joints that were."""
    names = [joint.name for joint in joints]
    counts: dict[str, int] = {}
    renamed = []
    for index in sorted(range(len(joints)), key=lambda i: joints[i].is_end):  # ends come last
        name = names[index]
        count = counts.get(name, 0) + 1
        while count > 1 and f"{name}_{count}" in counts:
            count += 1
        counts[name] = count
        if count > 1:
            names[index] = f"{name}_{count}"
            counts[names[index]] = 1
            renamed += [] if joints[index].is_end else [names[index]]
    return names, renamed


@dataclass
class _Open:
    """A joint while it is read."""

    name: str
    parent: int
    is_end: bool
    offset: list[float] | None = None
    channels: list[tuple[int, Column]] = field(default_factory=list)
    says_channels: bool = False


@dataclass
class _Parser:
    """Takes words one after another; what is open is a stack, so no depth is too deep."""

    path: Path
    words: list[str]
    findings: Findings
    place: int = 0
    joints: list[_Open] = field(default_factory=list)
    n_columns: int = 0

    def parse(self) -> None:
        first = self._next()
        if first.upper() != "HIERARCHY":
            raise bad_file(self.path, f"starts with {first[:40]!r}", "'HIERARCHY'")
        stack: list[int] = []
        while self.place < len(self.words):
            word = self._next()
            key = word.upper()
            top = self.joints[stack[-1]] if stack else None
            if key == "ROOT" and top is None:
                stack.append(self._open(word, -1, is_end=False))
            elif key == "JOINT" and top is not None and not top.is_end:
                stack.append(self._open(word, stack[-1], is_end=False))
            elif key in ("END", "ENDSITE", "END_SITE") and top is not None and not top.is_end:
                if key == "END" and self._peek().upper() == "SITE":
                    self.place += 1
                stack.append(self._open(word, stack[-1], is_end=True))
            elif key == "OFFSET" and top is not None:
                top.offset = self._offset(top.name)
            elif key == "CHANNELS" and top is not None and not top.is_end:
                self._channels(top)
            elif key == "CHANNELS" and top is not None and self._peek() == "0":
                self.place += 1
            elif key == "}" and top is not None:
                self._close(top)
                stack.pop()
            elif top is None and self.joints:
                raise bad_file(self.path, f"{word[:40]!r} after the root", "one ROOT, then MOTION")
            else:
                allowed = "OFFSET, CHANNELS, JOINT, End Site or }" if top else "ROOT"
                raise bad_file(self.path, f"{word[:40]!r} in the hierarchy", allowed)
        if stack or not self.joints:
            where = f"inside {self.joints[stack[-1]].name!r}" if stack else "without a ROOT"
            raise bad_file(self.path, f"the hierarchy ends {where}", "a } for each {")

    def _next(self) -> str:
        word = self._peek()
        self.place += 1
        return word

    def _peek(self) -> str:
        return self.words[self.place] if self.place < len(self.words) else ""

    def _until(self, *ends: str) -> Iterator[str]:
        while self._peek() and self._peek().upper() not in ends:
            yield self._next()

    def _open(self, keyword: str, parent: int, *, is_end: bool) -> int:
        name = " ".join(self._until("{", "}", "OFFSET", "CHANNELS"))
        if self._next() != "{" or not (name or is_end):
            what = f"{keyword} {name}".strip()[:60]
            raise bad_file(self.path, f"{what!r} in the hierarchy", "expected '{' after a name")
        name = name or f"{self.joints[parent].name}_end"
        self.joints.append(_Open(name, parent, is_end))
        return len(self.joints) - 1

    def _offset(self, name: str) -> list[float]:
        where = f"OFFSET of {name}"
        words = list(self._until(*_KEYWORDS))
        cells = [cell for word in words for cell in split_glued(word.rstrip(",").replace(",", "."))]
        if len(cells) == 6:  # SOMA adds how the joint is turned at rest; its channels say so too
            cells = cells[:3]
        if len(cells) != 3:
            raise bad_file(self.path, f"{where} has {len(cells)} numbers", "three")
        values = [missing_or_number(cell) for cell in cells]
        known = [value for value in values if value is not None and np.isfinite(value)]
        if len(known) != 3:
            raise bad_file(self.path, f"{where} is {' '.join(words)[:60]!r}", "three numbers")
        return known

    def _channels(self, joint: _Open) -> None:
        said = self._next()
        words = list(self._until(*_KEYWORDS))
        if said not in {str(n) for n in range(7)}:
            raise bad_file(self.path, f"{said[:20]} channels of {joint.name!r}", "0 to 6")
        if len(words) != int(said):
            self.findings.warn(f"{joint.name!r} has {len(words)} channels, not {said} as it says")
        own = [self._column(word, joint) for word in words]
        if len(set(own)) != len(own) or joint.says_channels:
            raise bad_file(self.path, f"a channel of {joint.name!r} twice", "each channel once")
        joint.says_channels = True
        joint.channels = list(enumerate(own, start=self.n_columns))
        self.n_columns += len(own)

    def _column(self, word: str, joint: _Open) -> Column:
        match = _CHANNEL.fullmatch(word.lower().rstrip(",;"))
        if match is None:
            raise bad_file(
                self.path, f"channel {word[:40]!r} of {joint.name!r}", "Xrotation, Yposition, ..."
            )
        axis = match[1] or match[4] or match[6]
        kind = match[2] or match[3] or match[5]
        return Column(joint.name, "xyz".index(axis), kind.startswith("r"), joint.parent < 0)

    def _close(self, joint: _Open) -> None:
        if joint.offset is None and joint.is_end:
            joint.offset = [0.0, 0.0, 0.0]
        if joint.offset is None:
            raise bad_file(self.path, f"{joint.name!r} has no OFFSET", "one for each joint")
        if not (joint.says_channels or joint.is_end):
            raise bad_file(self.path, f"{joint.name!r} has no CHANNELS", "them for each joint")
