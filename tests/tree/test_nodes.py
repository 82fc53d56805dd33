"""A node notices when it changes."""

import pickle
import subprocess
import sys

import numpy as np

from mplearn.state import Blob
from mplearn.tree import Node

BLOBS = [Blob(np.full((3, 1), float(k))) for k in range(3)]


def made() -> Node:
    node = Node(1, 0, 2)
    for k in range(2):
        node.add(k, np.full(k, 0.5))
    return node


def test_its_state_is_one_object_until_it_is_another() -> None:
    node = made()
    first = node.state(BLOBS.__getitem__)
    node.frozen = node.frozen
    node.children += (4,)
    node.children = ()
    assert node.state(BLOBS.__getitem__) is first
    twin = Node.from_state(first)
    twin.apart |= {3}
    twin.apart -= {3}
    assert twin.state(BLOBS.__getitem__) is first
    twin.frozen = True
    assert twin.state(BLOBS.__getitem__) != first == node.state(BLOBS.__getitem__)
    node.add(2, np.ones(2))
    assert node.state(BLOBS.__getitem__).members.tolist() == [0, 1, 2]


def test_no_node_of_another_process_is_taken_for_it() -> None:
    """Learners can be pickled; what was made of one node must not be taken for another's."""
    code = (
        "import pickle, sys; from mplearn.tree import Node;"
        "sys.stdout.buffer.write(pickle.dumps(Node(1, 0, 2)))"
    )
    one, other = (
        pickle.loads(subprocess.run([sys.executable, "-c", code], stdout=-1, check=True).stdout)
        for _ in range(2)
    )
    assert one == other and one.revision != other.revision
    twin, revision = pickle.loads(pickle.dumps((one, one.revision)))
    assert twin.revision is revision
