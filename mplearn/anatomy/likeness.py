"""How like a person's a body is that was found in a skeleton, and what is hardly one."""

from __future__ import annotations

import numpy as np

from ..errors import BodyError
from ..option_names import option
from .joint_tree import JointTree
from .name_hints import says_leg
from .plan import LimbPair, Plan

LEAST_CONFIDENCE = 0.15
USUAL_COST = 5.0  # of a pair of limbs, at which one may doubt


def likelier(
    name: str, tree: JointTree, whole: Plan | None, half: Plan | None, *, sure: bool
) -> Plan:
    """Return the body with legs and arms, or else the one with only those that names call so.

    Args:
        name: What the recording is called.
        tree: Its skeleton.
        whole: The likeliest body with both.
        half: The likeliest with one of them.
        sure: Whether a user says which joint is which.

    Raises:
        BodyError: Neither is like a person's, with the reason.
    """
    if whole is not None:
        problem = _problem(name, tree, whole, sure=sure)
        if not problem:
            return whole
        if half is None or _named_whole(tree, whole) or _problem(name, tree, half, sure=sure):
            raise BodyError(problem)
    assert half is not None
    if problem := _problem(name, tree, half, sure=sure):
        raise BodyError(problem)
    return half


def confidence(plan: Plan) -> float:
    """Return how sure it is that a plan is a person's, in [0, 1]."""
    pairs = [pair for pair in (plan.legs, plan.arms) if pair is not None]
    doubt = sum(pair.cost - USUAL_COST for pair in pairs)
    return float(1.0 / (1.0 + np.exp(0.5 * doubt)))


def _named_whole(tree: JointTree, plan: Plan) -> bool:
    """Return whether names call both pairs of limbs so: then there is more than a half."""
    return all(
        pair is not None
        and sign * says_leg([n for side in pair.nodes for node in side for n in tree.names[node]])
        > 0
        for pair, sign in ((plan.legs, 1), (plan.arms, -1))
    )


def _problem(name: str, tree: JointTree, plan: Plan, *, sure: bool) -> str:
    """Return what speaks against a plan; empty where nothing does."""
    arms, legs = plan.arms, plan.legs
    if sure:
        return ""
    if legs and arms and arms.one_root and not legs.one_root:
        # of a matchstick man both begin at one point; elsewhere the wrists are missing
        return (
            f"both arms of {name!r} would begin at {tree.names[arms.nodes[0][0]][0]!r}; are joints "
            f"missing in its arms? {option('names')} says which joint is which"
        )
    if confidence(plan) >= LEAST_CONFIDENCE:
        return ""
    limbs: tuple[tuple[str, LimbPair | None], ...] = (("leg", legs), ("arm", arms))
    would = " and the ".join(
        f"{what} {' '.join(tree.names[node][0] for node in pair.nodes[0])}"
        for what, pair in limbs
        if pair is not None
    )
    return (
        f"the skeleton of {name!r} is hardly a person's: it would have the {would}; "
        f"{option('names')} says which joint is which"
    )
