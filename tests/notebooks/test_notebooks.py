"""Every notebook runs, at a small size."""

from pathlib import Path

import pytest

PRINTS = {
    "01-from-markers-to-a-walk": "SegmentClosed",
    "02-train-an-agent": "0 illegal",
    "03-the-papers-experiments": "primitives 4\n",
    "04-compare-groups": "duration [s]: p = 0.0",
    "05-from-a-person-to-a-robots-file": "as in Isaac Lab",
}
NOTEBOOKS = sorted((Path(__file__).parents[2] / "notebooks").glob("*.ipynb"))


@pytest.mark.filterwarnings("default")
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    nbformat = pytest.importorskip("nbformat")
    nbclient = pytest.importorskip("nbclient")
    if "train" in path.stem:
        pytest.importorskip("sb3_contrib")
    monkeypatch.setenv("MPLEARN_NOTEBOOK_MOTIONS", "70")
    monkeypatch.setenv("MPLEARN_NOTEBOOK_STEPS", "3000")
    monkeypatch.setenv("MPLBACKEND", "agg")
    notebook = nbformat.read(path, as_version=4)
    done = nbclient.NotebookClient(notebook, timeout=300, kernel_name="python3").execute()
    printed = "".join(
        output.get("text", "") for cell in done.cells for output in cell.get("outputs", ())
    )
    assert PRINTS[path.stem] in printed
    assert "%" in printed  # predictions, success
    assert " -> " in printed.splitlines()[-1]  # the walk
