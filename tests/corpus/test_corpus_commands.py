"""Corpora on the command line."""

from importlib.util import find_spec
from pathlib import Path

import pytest
from frail_workers import Frail

from mplearn.corpus import RayTasks, learn_corpus, recognise_corpus, recognising
from mplearn.library import PrimitiveLibrary
from mplearn.store import StoreReader
from mplearn.tables import read_segments
from mplearn_agents.cli import main


def test_a_folder_is_learned_by_processes_and_goes_on(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, store = tmp_path / "all.mplearn", tmp_path / "all.db"
    asked = ["learn", str(folder), "--out", str(out), "--jobs", "1"]
    assert main([*asked, "--store", str(store)]) == 0
    said = capsys.readouterr().out
    assert "8 takes of 3 people in 4 shards" in said
    assert "left out: ben/broken: " in said
    library = PrimitiveLibrary.load(out)
    assert PrimitiveLibrary.load(store).version == library.version
    assert len(StoreReader(store).life.state().sources.done) == 8
    before = out.read_bytes()
    assert main(asked) == 0
    assert out.read_bytes() == before


@pytest.mark.parametrize(
    ("options", "why"),
    [
        (["--jobs", "1"], "--out"),
        (["--jobs", "1", "--ray", "--out", "x"], "not both"),
        (["--jobs", "1", "--strict", "--out", "x"], "--strict"),
        (["--jobs", "0", "--out", "x"], "--jobs must be at least 1, not 0"),
    ],
)
def test_what_does_not_go_together_is_refused(
    options: list[str], why: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["learn", str(folder), *options]) == 2
    assert why in capsys.readouterr().err


def test_a_folder_is_recognised_by_processes_as_by_one(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    learn_corpus(folder, tmp_path / "s", jobs=0).learner.snapshot().save(tmp_path / "a.mplearn")
    alone = recognise_corpus(tmp_path / "a.mplearn", folder, jobs=0)
    assert list(alone.refused) == ["ben/broken"]
    assert alone.n_takes == 8
    takes = alone.table.column("take")
    assert takes == sorted(takes)
    assert set(alone.table.column("person")) == {"anna", "ben", "cleo", ""}
    asked = ["recognise", str(tmp_path / "a.mplearn"), str(folder), "--jobs", "1"]
    assert main([*asked, "--to", str(tmp_path / "a.eaf")]) == 0
    assert read_segments(tmp_path / "a.eaf") == alone.table
    said = capsys.readouterr()
    assert "segments recognised in 8 takes" in said.out
    assert "left out: ben/broken" in said.err
    asked = ["recognise", str(tmp_path / "a.mplearn"), str(folder / "d.csv")]
    assert main([*asked, "--to", str(tmp_path / "d.csv")]) == 0
    assert "recognised in 1 take; written to" in capsys.readouterr().out
    assert [row.take for row in read_segments(tmp_path / "d.csv")].count("d") > 0
    known = [row for row in alone.table if row.primitive is not None]
    assert len(known) > 0.7 * len(alone.table)


@pytest.mark.parametrize("fatal", ["", "ben/a"])
def test_what_is_recognised_beside_a_worker_that_dies_is_not_lost(
    fatal: str, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    learn_corpus(folder, tmp_path / "s", jobs=0).learner.snapshot().save(tmp_path / "a.mplearn")
    alone = recognise_corpus(tmp_path / "a.mplearn", folder, jobs=0)
    monkeypatch.setattr(recognising, "_CHUNK", 2)
    frail = Frail(jobs=2, fatal=fatal and f"/{fatal}.csv")
    found = recognise_corpus(tmp_path / "a.mplearn", folder, executor=frail)
    frail.close()
    assert frail.most == 2
    assert frail.deaths >= 3
    assert sorted(found.refused) == sorted({"ben/broken", fatal} - {""})
    assert list(found.table) == [row for row in alone.table if row.take != fatal]
    assert all("2 times" in why for take, why in found.refused.items() if take == fatal)


def test_a_cluster_needs_ray(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    if find_spec("ray") is not None:
        pytest.skip("ray is installed here")
    assert main(["learn", str(folder), "--ray", "--out", "x.mplearn"]) == 2
    assert "mplearn[cluster]" in capsys.readouterr().err


def test_tasks_of_ray_learn_the_same(folder: Path, tmp_path: Path) -> None:
    pytest.importorskip("ray", reason="ray is not installed (extra cluster)")
    tasks = RayTasks()
    try:
        corpus = learn_corpus(folder, tmp_path / "s", executor=tasks)
    finally:
        tasks.close()
    alone = learn_corpus(folder, tmp_path / "t", jobs=0)
    files = [each.learner.save(tmp_path / "a").read_bytes() for each in (corpus, alone)]
    assert files[0] == files[1]
