"""The examples run, and say something."""

import runpy
from pathlib import Path

import pytest

from mplearn import segmentation
from mplearn.mocap import registry
from mplearn.tree import distance

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.py"))


def test_there_are_examples() -> None:
    assert len(EXAMPLES) >= 8


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_runs(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(registry, "_registered", list(registry._registered))
    monkeypatch.setattr(distance, "_KINDS", dict(distance._KINDS))
    monkeypatch.setattr(segmentation.registry, "SEGMENTERS", dict(segmentation.registry.SEGMENTERS))
    monkeypatch.setattr(segmentation, "SEGMENTERS", segmentation.registry.SEGMENTERS)
    runpy.run_path(str(path), run_name="__main__")
    assert capsys.readouterr().out.strip()
    assert not list(tmp_path.iterdir())
