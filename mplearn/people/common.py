"""What several people's leaves say together: one model a primitive, one recogniser."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..hmm import LeftRightHMM, fit
from ..recording import FloatArray
from ..tree import ROOT, PrimitiveTree, Recogniser


def common_model(models: Sequence[LeftRightHMM], exemplars: Sequence[FloatArray]) -> LeftRightHMM:
    """Return the group model of one primitive by several people.

    Args:
        models: Each person's own, whose variance floors hold here too.
        exemplars: The executions of all, shape (L, D) each.
    """
    n_states = min(model.n_states for model in models)
    floor = np.min([model.variances.min(axis=0) for model in models], axis=0)
    return fit(exemplars, n_states, variance_floor=floor)


def common_recogniser(
    trees: Mapping[int, PrimitiveTree], leaves: Mapping[int, Sequence[tuple[int, int]]]
) -> Recogniser:
    """Return one recogniser for all people.

    A primitive's exemplars are those of all its leaves, its width that of the widest of them.

    Args:
        trees: Each person's tree.
        leaves: Person and id in that person's tree of the leaves of each primitive.
    """
    states = {person: tree.recogniser().state() for person, tree in trees.items()}
    banks = {person: state["bank"] for person, state in states.items()}
    floor = np.mean([bank["floor"] for bank in banks.values()], axis=0)
    scales = {  # distances are counted in units of the variance floor
        person: float(np.sqrt(bank["floor"].mean() / floor.mean()))
        for person, bank in banks.items()
    }
    first, begins = 0, {}
    for person, bank in banks.items():
        begins[person] = first
        first += 1 + int(max(bank["numbers"], default=0))
    members, diameters = [], []
    for group in leaves.values():
        widths, numbers = [0.0], []
        for person, leaf in group:
            index = states[person]["index"]
            at = list(index["ids"]).index(leaf)
            widths.append(scales[person] * float(index["diameters"][at]))
            numbers += [begins[person] + number for number in index["members"][at]]
        members.append(numbers)
        diameters.append(max(widths))
    order = np.argsort(list(leaves))
    common = next(iter(states.values())) | {
        "bank": {
            "floor": floor,
            "numbers": np.concatenate([begins[p] + bank["numbers"] for p, bank in banks.items()]),
            "columns": np.concatenate([bank["columns"] for bank in banks.values()]),
            "duration": np.concatenate([bank["duration"] for bank in banks.values()]),
        },
        "index": next(iter(states.values()))["index"]
        | {
            "limit": max(scales[p] * float(state["index"]["limit"]) for p, state in states.items()),
            "ids": np.array(list(leaves), dtype=np.int64)[order],
            "parents": np.full(len(leaves), ROOT, dtype=np.int64),
            "leaves": np.ones(len(leaves), dtype=np.bool_),
            "members": [members[i] for i in order],
            "diameters": np.array(diameters)[order],
            "caps": None,
        },
    }
    recogniser = Recogniser.from_state(common)
    return recogniser.calibrated(recogniser.config.false_acceptance)
