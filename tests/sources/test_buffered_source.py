"""What waits for a slow reader: nothing lost, nothing changed, little memory."""

import errno
import tempfile
import threading
import time
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from played import Given, blocks, frames_of, texts_of

from mplearn.errors import InvalidValueError
from mplearn.sources import Block, BufferedSource, Change, Source, Stream, Tally, buffered

STREAM = Stream(("a", "b", "c"), 100.0)


def items_of(seed: int, n: int = 900) -> list[Block | Change]:
    """Return blocks of all sizes, with gaps, other streams, stretches and changes among them."""
    rng = np.random.default_rng(seed)
    items: list[Block | Change] = []
    stream, at = STREAM, 0
    while at < n:
        if rng.random() < 0.05:
            items.append(Change("names", f"other names from {at}", at / 100.0))
            stream = replace(stream)
        size = int(rng.choice([1, 1, 1, 7, 80]))
        frames = rng.normal(size=(size, 3))
        arrived_s = np.full(size, time.monotonic() - 5.0)
        gone = rng.random(size) < 0.1
        frames[gone], arrived_s[gone] = np.nan, np.nan
        items.append(
            Block(
                stream,
                frames,
                (at + np.arange(size)) / 100.0,
                arrived_s,
                joins=bool(rng.random() < 0.9),
                lost=int(gone.sum()),
                doubled=int(rng.integers(2)),
                late=int(rng.integers(2)),
            )
        )
        at += size
    return items


def taken_late(source: Source) -> list[Block | Change]:
    """Take what a source has only when all of it waits."""
    with BufferedSource(source) as waiting:
        while not source.ended:
            time.sleep(0.005)
        return list(waiting)


def stretches(items: list[Block | Change]) -> list[tuple[bytes, ...]]:
    """Return what is known of each frame, the stretch and the stream that it belongs to."""
    out, stretch, stream = [], 0, None
    for block in items:
        if isinstance(block, Change):
            continue
        if not block.joins or block.stream is not stream:
            stretch, stream = stretch + 1, block.stream
        for frame, *times in zip(block.frames, block.times_s, block.arrived_s, strict=True):
            out.append((b"%d" % stretch, frame.tobytes(), np.array(times).tobytes()))
    return out


@pytest.mark.parametrize("in_memory", [1, 4_000, 2**23])
def test_nothing_that_waits_is_lost_or_changed(
    in_memory: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(buffered, "_IN_MEMORY_BYTES", in_memory)
    monkeypatch.setattr(buffered, "_FILE_BYTES", 3_000)
    monkeypatch.setattr(buffered, "BEHIND_S", 1e-9)
    monkeypatch.setattr(buffered, "CAUGHT_UP_S", 0.0)
    for seed in range(4):
        items = items_of(seed)
        late = taken_late(Given(items))
        assert stretches(late) == stretches(items)
        for count in ("lost", "doubled", "late"):
            each = [
                sum(getattr(b, count) for b in of if isinstance(b, Block)) for of in (late, items)
            ]
            assert each[0] == each[1]
        for block in late:
            if isinstance(block, Block):
                assert block.lost == np.count_nonzero(block.gaps)
        assert texts_of(late, "names") == texts_of(items, "names")
        assert len(texts_of(late, "behind")) == 1  # from the first frame on


def test_what_waits_is_joined_up_to_half_a_second() -> None:
    frames = np.random.default_rng(0).normal(size=(500, 3))
    late = [b for b in taken_late(Given(blocks(STREAM, frames, size=1))) if isinstance(b, Block)]
    np.testing.assert_array_equal(frames_of(late), frames)
    assert {len(each) for each in late} == {buffered.AT_ONCE}


def test_a_long_wait_takes_little_memory() -> None:
    class Long(Given):
        def read(self, timeout_s: float | None = None) -> list[Block | Change]:
            (block,) = super().read()
            assert isinstance(block, Block)
            return [replace(block, frames=np.zeros((50, 100)))]  # made only now

    stream = Stream(tuple(f"c{i}" for i in range(100)), 100.0)
    source = Long(blocks(stream, np.zeros((45_000, 1)), size=50))
    tracemalloc.start()
    with BufferedSource(source) as waiting:
        while not source.ended:
            time.sleep(0.01)
        time.sleep(0.05)
        assert waiting.waiting_s > 400.0
        assert tracemalloc.get_traced_memory()[0] < 12e6  # of 36 MB
    tracemalloc.stop()


def test_where_no_file_can_be_written_the_source_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    def full(**_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(buffered, "_IN_MEMORY_BYTES", 4_000)
    monkeypatch.setattr(tempfile, "TemporaryFile", full)
    frames = np.random.default_rng(0).normal(size=(2_000, 3))
    source = Given(blocks(STREAM, frames))
    with BufferedSource(source) as waiting:
        time.sleep(0.3)
        assert waiting.waiting_s < 3.0
        assert not source.ended
        items = list(waiting)
    np.testing.assert_array_equal(frames_of(items), frames)
    assert any("No space left" in text for text in texts_of(items, "behind"))


def test_no_more_waits_than_is_allowed_and_what_is_left_is_counted() -> None:
    source = Given(blocks(STREAM, np.zeros((2_000, 3))))
    with BufferedSource(source, most_bytes=8_000) as waiting:
        time.sleep(0.2)
        taken = frames_of([*waiting.read(), *waiting.read()])
    tally = waiting.tally
    assert waiting.ended
    assert tally.frames == len(taken)
    assert 100 < tally.unread < 400
    with pytest.raises(InvalidValueError, match="most_bytes must be positive, not 0"):
        BufferedSource(Given([]), most_bytes=0)


@pytest.mark.parametrize("kind", [RuntimeError, SystemExit, KeyboardInterrupt])
def test_an_error_of_the_source_comes_after_all_before_it(kind: type[BaseException]) -> None:
    class Broken(Given):
        ended = False

        def read(self, timeout_s: float | None = None) -> list[Block | Change]:
            if not self._items:
                raise kind("the cable is out")
            return super().read()

    frames = np.arange(30.0).reshape(10, 3)
    came = threading.Event()
    with BufferedSource(Broken(blocks(STREAM, frames)), arrived=came.set) as waiting:
        assert came.wait(5.0)
        seen: list[Block | Change] = []
        with pytest.raises(kind, match="the cable is out"):
            while not waiting.ended:
                seen += waiting.read()
        assert waiting.ended
    np.testing.assert_array_equal(frames_of(seen), frames)


def test_only_who_reads_late_is_told_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(buffered, "BEHIND_S", 0.3)
    given = blocks(STREAM, np.zeros((200, 3)))
    held_back = [replace(b, arrived_s=np.full(len(b), time.monotonic() - 4.0)) for b in given]
    with BufferedSource(Given(held_back)) as waiting:
        assert not texts_of(list(waiting), "behind")  # the source knew the body only then
    with BufferedSource(Given(held_back)) as waiting:
        time.sleep(0.4)
        (said,) = texts_of(list(waiting), "behind")
    assert "after they came; what comes meanwhile waits" in said


def test_who_comes_in_time_gets_blocks_as_they_come() -> None:
    given = blocks(STREAM, np.zeros((21, 3)))

    class Slow(Source):
        name, tally = "slow:", Tally()

        @property
        def ended(self) -> bool:
            return not given

        def read(self, timeout_s: float | None = None) -> list[Block | Change]:
            time.sleep(0.05)
            return [replace(given.pop(0), arrived_s=np.full(7, time.monotonic()))]

        def close(self) -> None:
            given.clear()

    with BufferedSource(Slow()) as waiting:
        assert waiting.read(0.0) == []
        lengths = [len(each) for each in waiting if isinstance(each, Block)]
    assert sum(lengths) == 21
