"""Random damage to plain values and arrays, as `mplearn.state.to_plain` returns them."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

KINDS = (
    "missing",
    "none",
    "nan",
    "huge",
    "type",
    "shape",
    "reference",
    "negative",
    "twice",
    "strange",
)


IDS = {  # fields that name something by a number
    *("id", "ids", "parent", "parents", "children", "members", "settled", "apart", "numbers"),
    *("primitive", "nearest", "like", "local", "founded", "there", "person", "pins"),
}


class Damage(NamedTuple):
    """What was done, and where."""

    kind: str
    place: str


def damaged(plain: Any, rng: np.random.Generator) -> tuple[Any, Damage]:
    """Return plain values with one damage somewhere; what is not damaged is shared."""
    while True:
        kind = str(rng.choice(KINDS))
        steps = _descend(plain, rng)
        if kind == "reference" and not IDS.intersection(map(str, steps)):
            continue
        done = _apply(plain, list(steps), kind, rng)
        if done is not _NOTHING:
            return done, Damage(kind, _named(steps))


_NOTHING = object()


def _descend(value: Any, rng: np.random.Generator) -> list[Any]:
    """Return a random way down, each branch as likely as the next."""
    steps: list[Any] = []
    while isinstance(value, (dict, list)) and len(value) and (not steps or rng.random() < 0.92):
        keys = list(value) if isinstance(value, dict) else range(len(value))
        steps.append(keys[int(rng.integers(len(keys)))])
        value = value[steps[-1]]
    return steps


def _named(steps: list[Any]) -> str:
    return "".join(f"[{each}]" if isinstance(each, int) else f".{each}" for each in steps)[1:]


def _apply(value: Any, steps: list[Any], kind: str, rng: np.random.Generator) -> Any:
    if not steps:
        return _hurt(value, kind, rng)
    copy = value.copy()
    first = steps[0]
    if len(steps) == 1 and kind == "missing":
        del copy[first]
        return copy
    if len(steps) == 1 and kind == "twice" and isinstance(copy, list):
        copy.insert(first, copy[first])
        return copy
    if len(steps) == 1 and kind == "strange" and isinstance(copy, dict):
        return copy | {"strange": 1}
    copy[first] = _apply(value[first], steps[1:], kind, rng)
    return _NOTHING if copy[first] is _NOTHING else copy


def _pick(choices: list[Any], rng: np.random.Generator) -> Any:
    return choices[int(rng.integers(len(choices)))]


def _hurt(value: Any, kind: str, rng: np.random.Generator) -> Any:
    if kind == "none":
        return _NOTHING if value is None else None
    if kind == "type":
        if value is None:
            return _pick(["x", [], {}], rng)
        others = ["x", 7, 0.5, True, None, [], {}, np.zeros(3), "\ud800", [value]]
        if isinstance(value, float):  # a whole number is a number
            others = [each for each in others if type(each) is not int]
        others = [each for each in others if type(each) is not type(value)]
        return _pick(others, rng)
    if isinstance(value, np.ndarray):
        return _hurt_array(value, kind, rng)
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return _NOTHING
    if kind == "nan":
        return float("nan")
    if kind == "huge":
        return 1e300 if rng.random() < 0.5 or isinstance(value, float) else 10**30
    if kind == "negative" and isinstance(value, int):
        return -abs(value) - 2
    if kind == "reference" and isinstance(value, int):
        return value + int(rng.choice([1, 1000, 10**9]))
    return _NOTHING


def _hurt_array(value: np.ndarray, kind: str, rng: np.random.Generator) -> Any:
    if kind == "shape":
        choices = [value[None], value.ravel()[:-1], np.concatenate([value, value])]
        if value.ndim > 1:
            choices += [value[:, :-1], value[..., None]]
        found = _pick(choices, rng)
        return _NOTHING if found.shape == value.shape else found
    if kind == "type" or not value.size:
        return _NOTHING
    copy = value.copy()
    at = np.unravel_index(int(rng.integers(copy.size)), copy.shape)
    if copy.dtype.kind == "f" and kind in ("nan", "huge"):
        wrong = {"nan": np.nan, "huge": 1e300}[kind]
        if rng.random() < 0.3:
            copy[...] = wrong
        copy[at] = wrong
        return copy
    if copy.dtype == np.int64 and kind in ("huge", "negative", "reference"):
        wrong = {
            "huge": 2**62,
            "negative": -abs(int(copy[at])) - 2,
            "reference": int(copy[at]) + 10**6,
        }
        copy[at] = wrong[kind]
        return copy
    return _NOTHING


def same(a: Any, b: Any) -> bool:
    """Whether two plain values are equal bit for bit."""
    if isinstance(a, np.ndarray):
        return (
            isinstance(b, np.ndarray)
            and (a.dtype, a.shape) == (b.dtype, b.shape)
            and a.tobytes() == b.tobytes()
        )
    if isinstance(a, dict):
        return isinstance(b, dict) and a.keys() == b.keys() and all(same(a[k], b[k]) for k in a)
    if isinstance(a, list):
        return isinstance(b, list) and len(a) == len(b) and all(map(same, a, b))
    return type(a) is type(b) and (a == b or (a != a and b != b))
