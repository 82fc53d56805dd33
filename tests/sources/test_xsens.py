"""Xsens MVN's network streamer, by a sender of ours."""

import socket
import struct
import time
from pathlib import Path

import numpy as np
import pytest
from people import as_file, segments
from played import frames_of, texts_of
from servers import gather, learned, learned_from

from mplearn.maths.rotations import matrix_to_quaternion, quaternion_to_matrix
from mplearn.recording import FloatArray
from mplearn.sources import Block, Source, open_source
from mplearn.sources.inbox import Inbox
from mplearn.sources.protocols.addresses import host_and_port
from mplearn.sources.protocols.xsens import SEGMENTS, XsensReceiver

BODIES = {
    "Pelvis": "pelvis", "L5": "abdomen", "L3": "abdomen", "T12": "abdomen", "T8": "chest",
    "Neck": "chest", "Head": "head",
    **{
        f"{side}{segment}": f"{body}_{side[0].lower()}"
        for side in ("Left", "Right")
        for segment, body in (
            ("Shoulder", "clavicle"), ("UpperArm", "upper_arm"), ("ForeArm", "forearm"),
            ("Hand", "hand"), ("UpperLeg", "thigh"), ("LowerLeg", "shank"), ("Foot", "foot"),
            ("Toe", "toes"),
        )
    },
}  # fmt: skip


def person() -> tuple[FloatArray, FloatArray]:
    """Return the segments of a person: places (T, 23, 3) [m] and quaternions (T, 23, 4)."""
    places, turns = segments()
    at = np.stack([places[BODIES[name]] for name in SEGMENTS], axis=1)
    rise = (places["chest"] - places["abdomen"])[:, None]
    at[:, [2, 3]] += rise * np.array([0.4, 0.7])[:, None]
    at[:, 5] = 0.3 * at[:, 4] + 0.7 * at[:, 6]  # the neck
    quaternions = [matrix_to_quaternion(turns[BODIES[name]]) for name in SEGMENTS]
    return at.astype("f4").astype(float), np.stack(quaternions, axis=1).astype("f4").astype(float)


def datagram(
    places: FloatArray,
    turns: FloatArray,
    number: int,
    *,
    character: int = 0,
    kind: bytes = b"02",
    first: int = 0,
    part: int = 0x80,
) -> bytes:
    """Return the datagram of a frame, or of a part of it."""
    body = b"".join(
        struct.pack(">i7f", first + i + 1, *place, *turn)
        for i, (place, turn) in enumerate(zip(places, turns, strict=True))
    )
    header = struct.pack(
        ">6sIBBIBBBBHH",
        b"MXTP" + kind, number, part, len(places), number * 10, character, 23, 0, 0, 0, len(body),
    )  # fmt: skip
    return header + body


def send(source: Source, data: list[bytes], *, slowly: bool = True) -> None:
    address = host_and_port(source.name.partition(":")[2], 0)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        for i, each in enumerate(data):
            out.sendto(each, address)
            if slowly and i % 20 == 19:
                time.sleep(0.005)


def points(places: FloatArray, quaternions: FloatArray) -> FloatArray:
    """Return joints, and points 0.1 m along their axes, shape (T, 12 J)."""
    axes = quaternion_to_matrix(quaternions).transpose(0, 1, 3, 2)
    ends = places[:, :, None] + 0.1 * axes
    return np.concatenate([places.reshape(len(places), -1), ends.reshape(len(places), -1)], axis=1)


def test_a_suit_is_learned_bit_for_bit(tmp_path: Path) -> None:
    places, turns = person()
    data = [datagram(*pose, 700 + i) for i, pose in enumerate(zip(places, turns, strict=True))]
    with open_source("xsens:0") as source:
        items = gather(source, lambda: send(source, data), len(places))
        stream = source._raw
    assert stream is not None
    assert stream.rate_hz == 100.0
    file = as_file(stream, points(places, turns), look=100)
    np.testing.assert_array_equal(frames_of(items), file.frames)
    block = next(item for item in items if isinstance(item, Block))
    assert block.channels == file.channels
    reference = learned_from(file.frames, file.channels, 100.0, tmp_path / "file")
    assert learned(items, tmp_path / "live") == reference
    assert source.tally.faults() == {}
    whole = as_file(stream, points(places, turns))
    np.testing.assert_allclose(frames_of(items), whole.frames, atol=1e-4)


def test_centimetres_are_known() -> None:
    places, turns = person()
    data = [
        datagram(100.0 * place, turn, i)
        for i, (place, turn) in enumerate(zip(places[:130], turns[:130], strict=True))
    ]
    with open_source("xsens:0", observe="positions") as source:
        items = gather(source, lambda: send(source, data), 130)
    pelvis = frames_of(items)[:, :3]
    np.testing.assert_allclose(pelvis, places[:130, 0], atol=1e-5)


def test_lost_doubled_and_shuffled_packets_and_a_second_character() -> None:
    places, turns = person()
    rng = np.random.default_rng(0)
    n = 300
    kept = [i for i in range(n) if i < 130 or i == n - 1 or rng.random() > 0.05]
    order = sorted([*kept, *kept[150:170]], key=lambda i: i + rng.uniform(0, 3) * (i > 130))
    data = []
    for i in order:
        data.append(datagram(places[i], turns[i], i))
        if 200 <= i < n - 5:  # what comes after the last frame may be left unread
            data.append(datagram(places[i] + 1.0, turns[i], i, character=1))
    with open_source("xsens:0", observe="positions") as source:
        items = gather(source, lambda: send(source, data), n)
    frames = frames_of(items)
    gone = np.isnan(frames).all(axis=1)
    assert set(np.flatnonzero(~gone)) <= set(kept)
    np.testing.assert_array_equal(frames[~gone], points(places, turns)[:n][~gone])
    tally = source.tally
    assert tally.frames + tally.doubled + tally.late == len(order)
    assert tally.frames + tally.lost == n
    assert tally.foreign == len(data) - len(order)
    assert texts_of(items, "subject") == ["'character 1' appeared; 'character 0' is followed"]


def test_a_frame_in_parts_is_put_together() -> None:
    places, turns = person()
    receiver = XsensReceiver(("127.0.0.1", 0))
    inbox, here = Inbox(), ("127.0.0.1", 1)
    parts = [
        datagram(places[0, :10], turns[0, :10], 5, part=0),
        datagram(places[0, 10:], turns[0, 10:], 5, first=10, part=0x81),
    ]
    for part in reversed(parts):
        receiver.take(part, here, 0.0, inbox)
    (sample,) = inbox.take(0.0)
    np.testing.assert_array_equal(sample.values, points(places[:1], turns[:1])[0])
    for number in range(20):
        receiver.take(parts[0][:6] + struct.pack(">I", number) + parts[0][10:], here, 0.0, inbox)
    assert len(inbox.take(0.0)) == 1  # parts that stay alone are said
    receiver.close()


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "requires"),
        (b"MXTP02", "requires"),
        (b"X" * 60, "begin with MXTP"),
        (datagram(np.zeros((2, 3)), np.zeros((2, 4)), 0)[:-4], "bytes, of 2 segments"),
        (datagram(np.zeros((2, 3)), np.zeros((2, 4)), 0, kind=b"01"), "choose Position"),
    ],
)
def test_what_is_no_pose_is_refused(data: bytes, message: str) -> None:
    receiver = XsensReceiver(("127.0.0.1", 0))
    with pytest.raises((ValueError, struct.error), match=message):
        receiver.take(data, ("127.0.0.1", 1), 0.0, Inbox())
    receiver.close()


def test_other_messages_of_the_suit_are_passed_over() -> None:
    receiver = XsensReceiver(("127.0.0.1", 0))
    inbox = Inbox()
    receiver.take(datagram(np.zeros((1, 3)), np.zeros((1, 4)), 0, kind=b"12"), ("", 0), 0.0, inbox)
    assert len(inbox) == 0
    receiver.close()
