"""Where the real recordings lie: ``$MPLEARN_DATA``, or ``../shared/data`` beside the repository."""

import os
from pathlib import Path

import pytest

_folder = Path(os.environ.get("MPLEARN_DATA", Path(__file__).parents[1].parent / "shared" / "data"))
DATA: Path | None = _folder if _folder.is_dir() else None

needs_data = pytest.mark.skipif(
    DATA is None, reason=f"no recordings at {_folder.name!r}; set MPLEARN_DATA to their folder"
)

_cases = _folder.parent / "cases" / "files"
CASES: Path | None = _cases if _cases.is_dir() else None

needs_cases = pytest.mark.skipif(
    CASES is None, reason=f"no case files beside {_folder.name!r}; set MPLEARN_DATA to that folder"
)
