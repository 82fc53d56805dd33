"""Labels in files of their own beside recordings, for evaluation only.

A table names takes, in each the activities, and of each the stretches, in frames of the recording:
``{"86_01": {"kick": [[3196, 3496], [3522, 3771]], "punch": [[2000, 2502]]}, ...}``. Stretches may
overlap; what is named later holds then. Several such tables may lie beside the same recordings:
annotators differ.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

from ..errors import RecordingError
from ..recording import LabelledSegment, Recording


@dataclass(frozen=True)
class Annotations:
    """One table of labels.

    Attributes:
        name: The file's, without its suffix.
        stretches: For each take the stretches (start, end, activity), in order of the file.

    Example:
        >>> import numpy as np
        >>> from mplearn import Recording
        >>> labels = Annotations("by hand", {"take": ((0, 50, "walk"), (50, 100, "turn"))})
        >>> take = labels.label(Recording(np.zeros((100, 1)), 50.0, ("x",), name="take"))
        >>> [(label.start, label.label) for label in take.labels]
        [(0, 'walk'), (50, 'turn')]
    """

    name: str
    stretches: Mapping[str, tuple[tuple[int, int, str], ...]]

    def label(self, recording: Recording) -> Recording:
        """Return a recording with these labels instead of its own.

        Raises:
            RecordingError: The table does not name the take, or a stretch reaches beyond its end.
        """
        stretches = self.stretches.get(recording.name)
        if not stretches:
            raise RecordingError(f"{self.name}: no labels of {recording.name!r}")
        end = max(stretch[1] for stretch in stretches)
        if end > len(recording):
            raise RecordingError(
                f"{self.name}: a label of {recording.name!r} ends at frame {end}, and the "
                f"recording at {len(recording)}"
            )
        labels = tuple(LabelledSegment(*each, recording.person) for each in stretches)
        return replace(recording, labels=labels)


def read_annotations(path: Path) -> Annotations | None:
    """Read a table of labels; None where a JSON file is something else.

    Raises:
        RecordingError: The file cannot be read, or a stretch is not two frames in order.

    Example:
        >>> import json
        >>> from pathlib import Path
        >>> table = {"name": "by hand", "takes": {"take": [[0, 50, "walk"]]}}
        >>> _ = Path("labels.json").write_text(json.dumps(table))
        >>> read_annotations(Path("labels.json")) is None
        True
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise RecordingError(f"{path}: no JSON file that can be read ({error})") from error
    if not isinstance(content, dict) or not content:
        return None
    if not all(
        isinstance(take, dict) and all(isinstance(each, list) for each in take.values())
        for take in content.values()
    ):
        return None
    stretches = {
        take: tuple(
            (*_stretch(path, f"{take}, {label}", stretch), label)
            for label, found in labels.items()
            for stretch in found
        )
        for take, labels in content.items()
    }
    return Annotations(path.stem, MappingProxyType(stretches))


def _stretch(path: Path, where: str, stretch: Any) -> tuple[int, int]:
    match stretch:
        case [int(start), int(end)] if 0 <= start < end:
            return start, end
    raise RecordingError(
        f"{path}: {where}: {stretch!r} is no stretch; expected two frames in order, as [10, 20]"
    )
