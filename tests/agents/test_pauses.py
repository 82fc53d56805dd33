"""What is looked through for garbage in a process that follows a stream."""

import gc
import weakref
from collections.abc import Iterator

import pytest

from mplearn_agents.learning.pauses import short_pauses


class Cycle:
    """Something that refers to itself."""

    def __init__(self) -> None:
        self.own = self


@pytest.fixture(autouse=True)
def by_hand() -> Iterator[None]:
    """No collection but those of the test."""
    gc.disable()
    yield
    gc.enable()


def looked_at(each: object) -> bool:
    return any(each is other for other in gc.get_objects())


def test_what_is_there_or_has_stayed_is_left_out() -> None:
    old = Cycle()
    with short_pauses():
        assert not looked_at(old)
        young = Cycle()
        gc.collect(0)
        assert looked_at(young)
        gc.collect(1)
        assert not looked_at(young)
    assert looked_at(old) and looked_at(young)
    assert not gc.get_freeze_count()
    gc.collect(1)
    assert looked_at(young) and not gc.get_freeze_count()


@pytest.mark.parametrize("generation", [0, 1, 2])
def test_young_garbage_is_collected(generation: int) -> None:
    with short_pauses():
        gone = weakref.ref(Cycle())
        gc.collect(generation)
        assert gone() is None


def test_old_garbage_is_collected_in_the_end() -> None:
    with short_pauses():
        each = Cycle()
        gone = weakref.ref(each)
        gc.collect(1)
        del each
        gc.collect()
        assert gone() is not None
    gc.collect()
    assert gone() is None
