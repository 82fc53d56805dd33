"""Datagrams of the link: their layout, and what is refused."""

import struct
import zlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from link_world import CODE, N, posture

from mplearn_envs.link import Datagram, DatagramError, decode, encode
from mplearn_envs.link.datagram import base_coordinates, base_frame

finite = st.floats(allow_nan=False, allow_infinity=False, width=64)


@given(
    stream=st.integers(0, 2**32 - 1),
    sequence=st.integers(0, 2**32 - 1),
    time_s=finite,
    angles=st.lists(finite, max_size=8),
    last=st.booleans(),
)
def test_a_datagram_says_what_it_was_told(stream, sequence, time_s, angles, last):
    base = base_frame(0.8, 0.2, -0.4)
    told = Datagram(stream, sequence, time_s, base, np.array(angles), last)
    data = encode(told, CODE)
    assert len(data) == 84 + 8 * len(angles) + 4
    found = decode(data, CODE, len(angles))
    assert (found.stream, found.sequence, found.last) == (stream, sequence, last)
    assert found.time_s == time_s
    np.testing.assert_array_equal(found.base, base)
    np.testing.assert_array_equal(found.angles, angles)


def test_the_layout_is_the_documented_one():
    base, angles = posture()
    data = encode(Datagram(5, 6, 7.5, base, angles, True), CODE)
    assert data[:4] == b"MPLU"
    assert struct.unpack(">BBHIIId", data[4:28]) == (1, 1, N, CODE, 5, 6, 7.5)
    np.testing.assert_array_equal(np.frombuffer(data[28:84], ">f8"), base)
    np.testing.assert_array_equal(np.frombuffer(data[84:-4], ">f8"), angles)
    assert data[-4:] == struct.pack(">I", zlib.crc32(data[:-4]))


@given(st.binary(max_size=400))
def test_any_bytes_are_refused_by_one_error(data):
    with pytest.raises(DatagramError):
        decode(data, CODE, N)


@settings(max_examples=200)
@given(st.data())
def test_damaged_datagrams_are_refused(data):
    base, angles = posture()
    whole = bytearray(encode(Datagram(1, 2, 3.0, base, angles), CODE))
    place = data.draw(st.integers(0, len(whole) - 1))
    whole[place] ^= data.draw(st.integers(1, 255))
    with pytest.raises(DatagramError):
        decode(bytes(whole), CODE, N)
    with pytest.raises(DatagramError):
        decode(bytes(whole[:place]), CODE, N)


@pytest.mark.parametrize("wrong", ["nan", "infinite time", "no rotation", "robot", "size"])
def test_what_is_no_posture_for_this_robot_is_refused(wrong):
    base, angles = posture()
    time_s, code = 1.0, CODE
    if wrong == "nan":
        angles[3] = np.nan
    elif wrong == "infinite time":
        time_s = np.inf
    elif wrong == "no rotation":
        base[3:7] *= 1.1
    elif wrong == "robot":
        code += 1
    else:
        angles = angles[1:]
    with pytest.raises(DatagramError) as caught:
        decode(encode(Datagram(1, 2, time_s, base, angles), code), CODE, N)
    assert caught.value.fault == ("foreign" if wrong == "robot" else "malformed")


@given(st.floats(-1.5, 1.5), st.floats(-3.1, 3.1))
def test_frames_and_coordinates_are_inverse(roll, pitch):
    np.testing.assert_allclose(
        base_coordinates(base_frame(0.7, roll, pitch)), (0.7, roll, pitch), atol=1e-7
    )
