"""VMC, by a sender of ours: an avatar's bones by OSC."""

import socket
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from people import as_file, segments
from played import frames_of, texts_of
from servers import gather, learned, learned_from

from mplearn.maths.rotations import matrix_to_quaternion
from mplearn.recording import FloatArray
from mplearn.sources import Source, open_source
from mplearn.sources.inbox import Inbox, Sample
from mplearn.sources.protocols.addresses import host_and_port
from mplearn.sources.protocols.vmc import FROM_UNITY, PARENTS, VMCReceiver

pytest.importorskip("pythonosc")
from pythonosc.osc_bundle_builder import OscBundleBuilder
from pythonosc.osc_message_builder import OscMessageBuilder

BODIES = {
    "Hips": "pelvis", "Spine": "abdomen", "Chest": "chest", "Head": "head",
    **{
        f"{side}{bone}": f"{body}_{side[0].lower()}"
        for side in ("Left", "Right")
        for bone, body in (
            ("Shoulder", "clavicle"), ("UpperArm", "upper_arm"), ("LowerArm", "forearm"),
            ("Hand", "hand"), ("UpperLeg", "thigh"), ("LowerLeg", "shank"), ("Foot", "foot"),
            ("Toes", "toes"),
        )
    },
}  # fmt: skip
HERE = ("127.0.0.1", 1)


def above(bone: str) -> str:
    parent = PARENTS[bone]
    while parent and parent not in BODIES:
        parent = PARENTS[parent]
    return parent


def poses() -> dict[str, tuple[FloatArray, FloatArray]]:
    """Return local positions and quaternions (x, y, z, w) of bones, in Unity's axes."""
    places, turns = segments()
    found = {}
    for bone, body in BODIES.items():
        place, turn = places[body], turns[body]
        if above(bone):
            parent = BODIES[above(bone)]
            place = np.einsum("tij,ti->tj", turns[parent], place - places[parent])
            turn = turns[parent].transpose(0, 2, 1) @ turn
        unity = FROM_UNITY.T @ turn @ FROM_UNITY
        found[bone] = (place @ FROM_UNITY, matrix_to_quaternion(unity)[:, [1, 2, 3, 0]])
    return found


def message(address: str, *values: object) -> object:
    builder = OscMessageBuilder(address)
    for value in values:
        builder.add_arg(value, "s" if isinstance(value, str) else "f")
    return builder.build()


def bundle(i: int, *, bones: dict | None = None, root: bool = True) -> bytes:
    """Return a frame as one bundle."""
    builder = OscBundleBuilder(0)
    builder.add_content(message("/VMC/Ext/T", 3.0 + i / 64.0))
    if root:
        builder.add_content(message("/VMC/Ext/Root/Pos", "root", *(0.0,) * 6, 1.0))
    for bone, (place, turn) in (bones or poses_once()).items():
        values = [float(v) for v in (*place[i], *turn[i])]
        builder.add_content(message("/VMC/Ext/Bone/Pos", bone, *values))
    builder.add_content(message("/VMC/Ext/Blend/Val", "Joy", 0.5))
    return builder.build().dgram


_POSES: dict[str, tuple[FloatArray, FloatArray]] = {}


def poses_once() -> dict[str, tuple[FloatArray, FloatArray]]:
    if not _POSES:
        _POSES.update(poses())
    return _POSES


def send(source: Source, data: list[bytes]) -> None:
    address = host_and_port(source.name.partition(":")[2], 0)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        for i, each in enumerate(data):
            out.sendto(each, address)
            if i % 10 == 9:
                time.sleep(0.01)


def offline(data: list[bytes]) -> list[Sample]:
    """Return what the datagrams hold, without a network."""
    receiver, inbox = VMCReceiver(("127.0.0.1", 0)), Inbox(100_000)
    for each in data:
        receiver.take(each, HERE, 0.0, inbox)
    receiver.close()
    return [item for item in inbox.take(0.0) if isinstance(item, Sample)]


def test_an_avatar_is_learned_bit_for_bit(tmp_path: Path) -> None:
    n = len(next(iter(poses_once().values()))[0])
    data = [bundle(i) for i in range(n)]
    with open_source("vmc:0") as source:
        items = gather(source, lambda: send(source, data), n)
        assert source._raw is not None
        assert source._raw.rate_hz == 64.0
    samples = offline(data)
    frames = np.array([each.values for each in samples])
    file = as_file(samples[0].stream, frames, look=64)
    np.testing.assert_array_equal(frames_of(items), file.frames)
    reference = learned_from(file.frames, file.channels, 64.0, tmp_path / "file")
    assert learned(items, tmp_path / "live") == reference
    assert source.tally.faults() == {}


def test_bones_are_where_the_person_is() -> None:
    places, turns = segments()
    for i, sample in enumerate(offline([bundle(i) for i in range(40)])):
        at = dict(zip(sample.stream.points, sample.values.reshape(-1, 3), strict=True))
        for bone, body in BODIES.items():
            np.testing.assert_allclose(at[bone], places[body][i], atol=1e-5)
            along = at[bone] + 0.1 * turns[body][i][:, 1]
            np.testing.assert_allclose(at[f"{bone}>y"], along, atol=1e-5)


def test_single_messages_give_the_same_a_frame_later() -> None:
    whole = [bundle(i) for i in range(5)]
    single = []
    for i in range(5):
        single.append(message("/VMC/Ext/T", 3.0 + i / 64.0).dgram)
        single.append(message("/VMC/Ext/Root/Pos", "root", *(0.0,) * 6, 1.0).dgram)
        for bone, (place, turn) in poses_once().items():
            values = [float(v) for v in (*place[i], *turn[i])]
            single.append(message("/VMC/Ext/Bone/Pos", bone, *values).dgram)
    one, other = offline(whole), offline(single)
    assert len(one) == len(other) == 5
    for a, b in zip(one, other, strict=True):
        np.testing.assert_array_equal(a.values, b.values)
        assert a.time_s == b.time_s


def test_without_a_root_and_with_a_bone_missing() -> None:
    some = {bone: pose for bone, pose in poses_once().items() if bone != "LeftHand"}
    data = [bundle(i, root=False) for i in range(3)] + [bundle(3, bones=some, root=False)]
    samples = offline([*data, bundle(4, root=False), bundle(5, root=False)])
    assert len(samples) >= 5
    gone = samples[3].values.reshape(-1, 3)
    names = samples[3].stream.points
    lost = {name for name, place in zip(names, gone, strict=True) if np.isnan(place).any()}
    assert lost == {"LeftHand", "LeftHand>x", "LeftHand>y", "LeftHand>z"}


@pytest.mark.parametrize(
    "data",
    [b"", b"#bundle\0", b"/VMC/Ext/Bone/Pos\0\0\0,s\0\0Hips\0\0\0\0", b"\xff" * 40],
)
def test_what_cannot_be_read_is_counted(data: bytes) -> None:
    good = [bundle(i) for i in range(100)]
    with open_source("vmc:0", observe="positions") as source:
        items = gather(source, lambda: send(source, [*good[:50], data, *good[50:]]), 100)
    assert len(frames_of(items)) == 100
    assert source.tally.damaged == (1 if data != b"#bundle\0" else source.tally.damaged)
    assert len(texts_of(items, "damaged")) == source.tally.damaged


def test_nothing_that_comes_in_is_logged(caplog: pytest.LogCaptureFixture) -> None:
    for junk in (b"\x1b[2J", b"/a\0\0,?\0\0"):
        nested = b"#bundle\0" + bytes(8) + len(junk).to_bytes(4, "big") + junk
        receiver, inbox = VMCReceiver(("127.0.0.1", 0)), Inbox()
        with suppress(ValueError):
            receiver.take(nested, HERE, 0.0, inbox)
        receiver.close()
    assert caplog.records == []


def test_too_few_bones_are_no_body() -> None:
    few = {bone: poses_once()[bone] for bone in ("Hips", "Head", "LeftHand", "RightHand")}
    assert offline([bundle(i, bones=few) for i in range(4)]) == []
