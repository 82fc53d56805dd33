"""A table of nodes knows what has changed in it, and keeps the states of what has not."""

import copy
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mplearn.state import Blob, Kept, checkpoint
from mplearn.tree.nodes.node import Node
from mplearn.tree.nodes.node_table import NodeTable

FRAMES = Blob(np.arange(8.0).reshape(4, 2))
steps = st.lists(
    st.tuples(st.sampled_from(["add", "change", "remove", "look"]), st.integers(0, 200)),
    max_size=60,
)


def same(row, table):
    states = [node.state(lambda _: FRAMES) for node in table.values()]
    return len(row) == len(states) and all(a is b for a, b in zip(row, states, strict=True))


@given(steps)
def test_what_changed_is_what_differs(steps):
    table = NodeTable([Node(0, None, 0)])
    marks = [(table.mark(), {0: table[0].revision})]
    for what, id in steps:
        if what == "add" and id > max(table):
            table[id] = Node(id, 0, 1)
        elif what == "change" and id in table:
            table[id].n_placed += 1
        elif what == "remove" and id in table and id:
            gone = table[id]
            del table[id]
            gone.n_placed = 7  # nobody minds
        elif what == "look":
            marks.append((table.mark(), {id: node.revision for id, node in table.items()}))
            assert same(table.states(lambda _: FRAMES), table)
        for mark, then in marks:
            found = table.changed_since(mark)
            now = {id: node.revision for id, node in table.items()}
            differs = {id for id in now.keys() | then if now.get(id) is not then.get(id)}
            assert found is not None and differs <= found.keys()
            assert all(table.get(id) is node for id, node in found.items())
    assert table.changed_since(table.mark()) == {}
    assert same(table.states(lambda _: FRAMES), table)


def test_nobody_knows_what_changed_in_another_table_nor_after_very_many_were_gone():
    table, other = NodeTable([Node(0, None, 0)]), NodeTable([Node(0, None, 0)])
    mark = table.mark()
    assert table.changed_since(None) is other.changed_since(mark) is None
    for id in range(1, 500):
        table[id] = Node(id, 0, 1)
        del table[id]
    assert table.changed_since(mark) is None
    assert len(table._changed) < 100
    mark = table.mark()
    for copied, then in (copy.deepcopy((table, mark)), pickle.loads(pickle.dumps((table, mark)))):
        assert list(copied) == [0] and copied.changed_since(then) is None


@pytest.mark.parametrize("n", [100, 4000])
def test_what_one_more_costs_does_not_grow_with_the_table(n, monkeypatch):
    """Counted: the nodes that are asked, the parts that are packed, what is written of them."""
    table = NodeTable(Node(id, None if id == 0 else 0, 0) for id in range(n))
    first = checkpoint(table.states(lambda _: FRAMES))
    kept = Kept()
    kept.add(1, first.held)
    asked = []
    state = Node.state
    monkeypatch.setattr(Node, "state", lambda node, of: asked.append(node.id) or state(node, of))
    table[n // 2].n_placed += 1
    later = checkpoint(table.states(lambda _: FRAMES), kept)
    assert len(asked) <= 64 and n // 2 in asked
    assert len(later.new) == 2  # the node, and the block that it is in
    assert sum(map(len, later.new.values())) < 4000
    kept.add(2, later.held)
    assert len(kept.drop(1)) == 2  # what those took the place of
    assert all(key in kept for key in later.parts) and len(kept) == len(later.parts)
