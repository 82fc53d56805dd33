"""What a person asks of the tree, checked before anything changes."""

from __future__ import annotations

from collections.abc import Sequence

from ..errors import InvalidValueError, UnknownPrimitiveError
from .nodes.clustering import two_branches
from .nodes.node import Node
from .nodes.structure import Structure
from .placement import ROOT

_LEAST = 2  # exemplars of a primitive; one alone has no width


def leaf_of(structure: Structure, id: int) -> Node:
    """Return a primitive that may change.

    Raises:
        UnknownPrimitiveError: There is none of this id.
        InvalidValueError: It is frozen.
    """
    node = primitive_of(structure, id)
    if node.frozen:
        raise InvalidValueError(f"primitive {id} is frozen; unfreeze it first")
    return node


def primitive_of(structure: Structure, id: int) -> Node:
    """Return a primitive.

    Raises:
        UnknownPrimitiveError: There is none of this id.
    """
    node = structure.nodes.get(id)
    if node is None or id == ROOT or not node.is_leaf:
        known = [each.id for each in structure.nodes.values() if each.is_leaf and each.id != ROOT]
        raise UnknownPrimitiveError(f"no primitive {id}; known are {known}")
    return node


def pair_of(structure: Structure, first: int, second: int) -> tuple[Node, Node]:
    """Return two primitives, the older one first.

    Raises:
        UnknownPrimitiveError: There is no such primitive.
        InvalidValueError: They are the same.
    """
    nodes = leaf_of(structure, first), leaf_of(structure, second)
    if first == second:
        raise InvalidValueError(f"primitive {first} cannot be merged with itself")
    older, younger = sorted(nodes, key=lambda node: node.id)
    return older, younger


def chosen_groups(leaf: Node, groups: Sequence[Sequence[int]] | None) -> list[list[int]]:
    """Return the numbers of a leaf's exemplars, as grouped by position or by their branches.

    Raises:
        InvalidValueError: The groups are wrong, or there are too few exemplars.
    """
    n = len(leaf.members)
    if groups is None:
        branches = two_branches(leaf.matrix, _LEAST)
        if branches is None:
            raise InvalidValueError(
                f"primitive {leaf.id} has no two groups of {_LEAST} exemplars: it keeps {n}"
            )
        groups = [branch.tolist() for branch in branches]
    at = sorted(int(i) for group in groups for i in group)
    if len(groups) < 2 or min(len(group) for group in groups) < _LEAST or at != list(range(n)):
        raise InvalidValueError(
            f"groups must hold each of the positions 0 to {n - 1} once, in 2 groups or more of at "
            f"least {_LEAST}, not {[[int(i) for i in group] for group in groups]}"
        )
    return [[leaf.members[int(i)] for i in group] for group in groups]


def place_below(structure: Structure, id: int, parent: int) -> tuple[Node, Node]:
    """Return a node and the node that it is to be hung below.

    Raises:
        UnknownPrimitiveError: There is no such node.
        InvalidValueError: The parent is a primitive, or lies below the node.
    """
    nodes = structure.nodes
    for each in (id, parent):
        if each not in nodes:
            raise UnknownPrimitiveError(f"no node {each} in the tree; it holds {list(nodes)}")
    if id == ROOT:
        raise InvalidValueError(f"the root, {ROOT}, lies below nothing")
    if parent != ROOT and nodes[parent].is_leaf:
        inner = [node.id for node in nodes.values() if node.id == ROOT or not node.is_leaf]
        raise InvalidValueError(f"a parent must be one of {inner}, not the primitive {parent}")
    at: int | None = parent
    while at is not None:
        if at == id:
            raise InvalidValueError(f"node {parent} lies below {id} and cannot be above it")
        at = nodes[at].parent
    return nodes[id], nodes[parent]
