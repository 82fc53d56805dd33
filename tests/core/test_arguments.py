"""Whatever is given to the doors of the library, what cannot be is told as an error of ours."""

import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mplearn import LearnerConfig, MotionLearner
from mplearn import sources as so
from mplearn import store as st
from mplearn.errors import InvalidValueError, MPLearnError
from mplearn.people import PeopleConfig
from mplearn.tree import NormalisationConfig, TreeConfig

WRONG: dict[str, Any] = {
    "text": "a.db",
    "none": None,
    "negative": -1,
    "nan": float("nan"),
    "infinite": float("inf"),
    "object": object(),
    "list": [1],
    "bytes": b"x",
    "array": np.zeros(3),
    "dict": {},
    "empty": "",
    "class": int,
    "huge": 10**400,
}
CONFIG = LearnerConfig(("a", "b"), 100.0)


def fields_of(settings: object) -> dict[str, Any]:
    return {name: getattr(settings, name) for name in inspect.signature(type(settings)).parameters}


DOORS: dict[str, tuple[Callable[..., Any], dict[str, Any]]] = {
    "LifelongLearner": (
        st.LifelongLearner,
        {"learner": MotionLearner(CONFIG), "store": None, "done": ()},
    ),
    "LifelongLearner.open": (
        st.LifelongLearner.open,
        {"path": "here.db", "create": lambda: MotionLearner(CONFIG), "checkpoint_s": 30.0},
    ),
    "Store": (st.Store, {"path": "there.db", "checkpoint_s": 30.0}),
    "StoreReader": (st.StoreReader, {"path": "known.db"}),
    "learner_of": (st.learner_of, {"path": "known.db"}),
    "library_of": (st.library_of, {"path": "known.db"}),
    "backup": (st.backup, {"path": "known.db", "to": "copy.db"}),
    "check": (st.check, {"path": "known.db"}),
    "info": (st.info, {"path": "known.db"}),
    "is_begun": (st.is_begun, {"path": "known.db"}),
    "MotionLearner": (MotionLearner, {"config": CONFIG}),
    "LearnerConfig": (LearnerConfig, fields_of(CONFIG)),
    "PeopleConfig": (PeopleConfig, fields_of(PeopleConfig())),
    "TreeConfig": (TreeConfig, fields_of(TreeConfig())),
    "NormalisationConfig": (NormalisationConfig, fields_of(NormalisationConfig())),
    "Stream": (so.Stream, {"channels": ("a", "b"), "rate_hz": 100.0}),
    "Wanted": (so.Wanted, fields_of(so.Wanted())),
    "open_source": (
        so.open_source,
        {"name": "demonstrator:7", "observe": "robot", "at_hz": None, "record": None, "speed": 2.0},
    ),
    "connect": (so.connect, {"name": "demonstrator:7", "wanted": None, "speed": 2.0}),
    "register_source": (so.register_source, {"kind": "odd", "factory": so.connect}),
    "BufferedSource": (
        so.BufferedSource,
        {"source": so.connect("demonstrator:7"), "folder": None, "most_bytes": 1000},
    ),
}


@pytest.mark.parametrize("door", DOORS)
def test_only_errors_of_ours_come_out(
    door: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    registered = dict(so.registry._registered)
    st.LifelongLearner.open("known.db", lambda: MotionLearner(CONFIG)).close()
    call, known = DOORS[door]
    refused = 0
    for name in known:
        for value in WRONG.values():
            try:
                made = call(**(known | {name: value}))
            except MPLearnError as error:
                assert str(error)
                refused += 1
            else:
                if hasattr(made, "close"):
                    made.close()
                for each in Path().glob("*copy.db"):
                    each.unlink()
    assert refused >= 4 * len(known)
    so.registry._registered.clear()
    so.registry._registered.update(registered)


def test_what_is_meant_is_told() -> None:
    with pytest.raises(InvalidValueError, match=r"LifelongLearner.open\(path, create\)"):
        st.LifelongLearner(MotionLearner(CONFIG), store="a.db")  # type: ignore[arg-type]
    with pytest.raises(InvalidValueError, match=r"learner must be a MotionLearner, not 'a.db'"):
        st.LifelongLearner("a.db")  # type: ignore[arg-type]
    with pytest.raises(InvalidValueError, match="channels must be several names, not 'hip'"):
        LearnerConfig("hip")  # type: ignore[arg-type]
    with pytest.raises(InvalidValueError, match="rate_hz must be a number, not '100'"):
        LearnerConfig(("hip",), "100")  # type: ignore[arg-type]
    with pytest.raises(InvalidValueError, match="source must be a Source"):
        so.BufferedSource("demonstrator")  # type: ignore[arg-type]
    with pytest.raises(InvalidValueError, match="path must be the path of a file, not None"):
        st.Store(None)  # type: ignore[arg-type]
    assert LearnerConfig(["hip"], np.float64(50)).channels == ("hip",)
