"""What installed packages bring joins by its name; what is broken is named."""

from dataclasses import replace
from typing import Any

import pytest

from mplearn import plugins, segmentation
from mplearn.errors import InvalidValueError, MPLearnError
from mplearn.segmentation import ZeroVelocity, make_segmenter, register_segmenter
from mplearn.tree import Distance, LikelihoodDistance, TreeConfig, distance, make_distance


class Point:
    def __init__(self, name: str, brings: Any) -> None:
        self.name, self.brings = name, brings

    def load(self) -> Any:
        if isinstance(self.brings, Exception):
            raise self.brings
        return self.brings


class Theirs(LikelihoodDistance):
    """A distance of an installed package."""


@pytest.fixture
def install(monkeypatch: pytest.MonkeyPatch) -> Any:
    kinds, segmenters = dict(distance._KINDS), dict(segmentation.SEGMENTERS)
    monkeypatch.setattr(distance, "_KINDS", kinds)
    monkeypatch.setattr(segmentation.registry, "SEGMENTERS", segmenters)
    loaders = distance._load_entry_points, segmentation.registry._load_entry_points

    def installed(**groups: Point) -> None:
        for load in loaders:
            load.cache_clear()
        points = {f"mplearn.{group}": [point] for group, point in groups.items()}
        monkeypatch.setattr(plugins, "entry_points", lambda group: points.get(group, []))

    yield installed
    for load in loaders:
        load.cache_clear()


def test_a_package_brings_a_distance_and_a_segmenter(install: Any) -> None:
    config = replace(TreeConfig(), distance="theirs")
    with pytest.raises(InvalidValueError, match="no distance 'theirs'"):
        make_distance(config)
    install(distances=Point("theirs", Theirs), segmenters=Point("slow", ZeroVelocity))
    found: Distance = make_distance(config)
    assert type(found) is Theirs
    assert type(make_segmenter("slow", 2, 100.0)) is ZeroVelocity
    with pytest.raises(InvalidValueError, match="'slow' already"):
        register_segmenter("slow", Theirs)  # type: ignore[arg-type]


def test_what_cannot_be_loaded_is_named(install: Any) -> None:
    install(segmenters=Point("slow", ImportError("no torch")))
    with pytest.raises(MPLearnError, match=r"segmenter 'slow' of an installed.*no torch"):
        make_segmenter("zero-velocity", 2, 100.0)
    install(distances=Point("likelihood", Theirs))  # a name that is taken
    with pytest.raises(MPLearnError, match=r"distance 'likelihood' of an installed.*already"):
        make_distance(TreeConfig())
