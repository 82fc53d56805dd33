"""A folder of recordings that are cheap to learn, of three people and of somebody unnamed."""

from pathlib import Path

import pytest
from corpus_folder import write_take


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Eight takes, and one that is damaged."""
    folder = tmp_path_factory.mktemp("corpus") / "takes"
    takes = ["anna/a", "anna/b", "ben/a", "ben/b", "cleo/a", "cleo/b", "d", "e"]
    for seed, name in enumerate(takes):
        write_take(folder / f"{name}.csv", 14.0, seed)
    (folder / "ben" / "broken.csv").write_text("time_s,a,b,c,d\n0.0,1,2\n", encoding="utf-8")
    return folder
