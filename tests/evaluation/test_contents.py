"""Contents and styles from names, told apart by what is learned."""

from dataclasses import replace

import numpy as np
import pytest
from sklearn.metrics import adjusted_rand_score  # type: ignore[import-untyped]

from mplearn.demonstrator import demonstrate
from mplearn.evaluation.contents import content_of, merged
from mplearn.evaluation.experiments import content_table
from mplearn.evaluation.partitions import adjusted_rand


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("dataset-2_raise-up-both-hands_active_011", ("raise-up-both-hands", "active")),
        ("dataset-1_dance-long_old_001", ("dance-long", "old")),
        ("run_normal_6", ("run", "normal")),
        ("13_29", None),
        ("m01_s02", None),
        ("walk_normal", None),
        ("walk_001", None),
    ],
)
def test_a_name_tells_content_and_style(name, told):
    assert content_of(name) == told


def test_what_may_share_primitives_is_one():
    kinds = ["walk", "walk-turn-left", "walk-turn-right", "run", "walk-left"]
    assert [merged(kind) for kind in kinds] == ["walk", "walk", "walk", "run", "walk-left"]
    for side in ("left-hand", "right-hand", "both-hands"):
        assert merged(f"raise-up-{side}") == merged(f"wave-{side}") == side
    assert merged("wave") == "wave"


def test_the_adjusted_rand_index_is_scikit_learns():
    rng = np.random.default_rng(0)
    for _ in range(20):
        a, b = rng.integers(0, 4, (2, 30))
        assert adjusted_rand(a, b) == pytest.approx(adjusted_rand_score(a, b))


def test_contents_are_told_apart_in_each_style_and_together():
    takes = []
    for i in range(6):
        for content, script in (("wave-left-hand", ["BAR", "BAL"]), ("bow", ["BAD", "BAU"])):
            take = demonstrate(script * 2, seed=i).recording
            style = "slow" if i % 2 else "plain"
            takes.append(replace(take, name=f"{content}_{style}_{i}", labels=()))
    takes.append(replace(takes[0], name="nameless"))
    bad = replace(takes[0], frames=np.full_like(takes[0].frames, np.nan), name="bow_plain_9")
    table = content_table([*takes, bad])
    rows = {(row[0], row[2]): row for row in table.rows}
    assert set(rows) == {
        (style, kind)
        for style in ("plain", "slow", "plain + slow")
        for kind in ("as named", "merged")
    }
    both = rows["plain + slow", "as named"]
    assert both[4] == "2 of 2"
    assert float(both[5].removesuffix(" %")) > 90.0
    assert "nameless" not in table.note
