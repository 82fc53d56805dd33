"""Tables of policies and agents: what they hold, what is kept, and what is refused."""

import pytest
from standing_library import standing_library

from mplearn_agents.cli import main
from mplearn_agents.contests import contest
from mplearn_agents.episodes import play
from mplearn_agents.policies import RandomWalk

pytest.importorskip("sb3_contrib")
pytest.importorskip("tensorboard")

SMALL = ("arms up", "arms down", "bow down", "bow up")


class Stroller(RandomWalk):
    """In place of an agent."""

    def require_fit(self, env):
        pass


def test_a_table_of_policies_and_agents_and_what_is_kept_of_it(tmp_path, capsys, monkeypatch):
    library = standing_library(SMALL).save(tmp_path / "small.mplearn")
    table = ["compare", "--library", str(library), "--out", str(tmp_path),
             "--tasks", "goal", "--policies", "random", "quick-path", "--seeds", "2",
             "--episodes", "3", "--simulated-episodes", "1", "--steps", "1",
             "--jobs", "1"]  # fmt: skip
    assert main(table) == 0
    file = tmp_path / "compare.md"
    written = file.read_text()
    rows = [line for line in written.splitlines() if line.startswith("| goal")]
    assert [row.split(" | ")[1:3] for row in rows] == [
        [dynamics, policy]
        for dynamics in ("kinematic", "simulated")
        for policy in ("random", "quick-path", "maskable-ppo, prior as logits")
    ]
    assert all("100.0 ± 0.0 %" in row for row in rows if "quick-path" in row)
    played = []
    with monkeypatch.context() as patched:
        patched.setattr(contest, "play", lambda *asked: played.append(asked) or play(*asked))
        patched.setattr(contest, "train", None)  # nothing is trained again
        assert main(table) == 0
        assert file.read_text() == written and not played
        lost = tmp_path / "episodes" / "goal-simulated-random-101.json"
        lost.write_text("[")
        assert main([*table, "--episodes", "3"]) == 0
        assert file.read_text() == written and len(played) == 1
        patched.setattr(contest, "train", lambda *asked, resume: Stroller())
        assert main([*table, "--policies", "random", "--dynamics", "kinematic", "--variants"]) == 0
    rows = [line for line in file.read_text().splitlines() if line.startswith("| goal")]
    agents = [row.split(" | ")[2] for row in rows]
    assert agents == [
        "random",
        "maskable-ppo, prior as logits",
        "maskable-ppo, prior as feature",
        "maskable-ppo, prior as logits",
        "maskable-ppo, prior as regulariser",
        "maskable-ppo, prior as logits",
        "ppo, prior as logits",
        "dqn, prior as feature",
    ]
    assert rows[1] == rows[3] == rows[5]


def test_version_1_is_played_with_people_and_read_on_the_scale_of_the_best(tmp_path, capsys):
    out = ["--out", str(tmp_path), "--jobs", "1", "--seeds", "2", "--episodes", "2"]
    played = ["--tasks", "goal", "--dynamics", "kinematic", "--algorithms"]
    policies = ["--policies", "random", "quick-path", "pooled-path"]
    assert main(["compare", "--env", "v1", *out, *played, *policies]) == 0
    shown = capsys.readouterr().out
    assert "time on the wall" in shown and "a macro step" in shown
    rows = [line for line in (tmp_path / "compare.md").read_text().splitlines() if "| goal" in line]
    cells = [row.strip("| ").split(" | ") for row in rows]
    assert [row[1:3] for row in cells] == [
        [f"kinematic, {people}", policy]
        for people in ("train", "test")
        for policy in ("random", "quick-path", "pooled-path")
    ]
    share = {tuple(row[1:3]): float(row[4].split()[0]) for row in cells}
    for people in ("train", "test"):
        where = f"kinematic, {people}"
        assert share[where, "quick-path"] == pytest.approx(100.0, abs=0.5)
        assert share[where, "random"] < share[where, "pooled-path"] <= 100.5


def test_what_is_missed_of_the_oracle_in_the_same_episodes_is_regret(tmp_path):
    out = ["--out", str(tmp_path), "--jobs", "1", "--seeds", "2", "--episodes", "1"]
    played = ["--tasks", "follow", "--dynamics", "kinematic", "--algorithms", "--people", "test"]
    policies = ["--policies", "mirror", "oracle", "--changes", "people"]
    assert main(["compare", "--env", "v1", *out, *played, *policies]) == 0
    rows = [line for line in (tmp_path / "compare.md").read_text().splitlines() if "| foll" in line]
    cells = {row.strip("| ").split(" | ")[2]: row.strip("| ").split(" | ") for row in rows}
    assert cells["mirror"][1] == "kinematic, test, people changes"
    returns = {name: float(row[3].split()[0]) for name, row in cells.items()}
    regret = {name: float(row[-1].split()[0]) for name, row in cells.items()}
    assert regret["oracle"] == 0.0 and regret["mirror"] > 0.5
    assert regret["mirror"] == pytest.approx(returns["oracle"] - returns["mirror"], abs=0.11)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--env", "v1", "--people", "nobody"], "people must be among"),
        (["--env", "v1", "--changes", "some"], "changes must be among"),
        (["--changes", "all"], "compare with env='v1'"),
        (["--env", "v1", "--changes", "all", "--tasks", "goal"], "let it be a task"),
        (["--bodies", "soft"], "bodies must be among"),
        (["--tasks", "goal", "fly"], "tasks must be among"),
        (["--policies", "mirrored"], "policies must be among"),
        (["--seeds", "1"], "at least 2 seeds"),
        (["--jobs", "0"], "--jobs must be at least 1, not 0"),
        (["--algorithms", "sarsa"], "algorithm must be one of"),
    ],
)
def test_bad_comparisons_are_refused_before_they_begin(tmp_path, capsys, options, message):
    assert main(["compare", "--out", str(tmp_path), *options]) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "episodes").exists()
