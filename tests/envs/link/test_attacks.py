"""A stranger's upper body cannot throw the robot, nor make it leave any limit."""

import itertools

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from link_world import PERIOD_S, ROBOT

from mplearn.maths.yaw_roll_pitch import roll_pitch_matrix
from mplearn_envs.link import LowerBody, Receiver, Sender, UpperBody
from mplearn_envs.link.__main__ import main
from mplearn_envs.link.attacks import ATTACKS, Attacker, under_attack
from mplearn_envs.link.restraint import Restraint
from mplearn_envs.mechanics import reference_robot, rest_reference
from mplearn_envs.mechanics.kinematics import forward
from mplearn_envs.mechanics.servos import Bounds, approach
from mplearn_envs.mechanics.velocity_ik import errors, settle

SECONDS = 2.0  # each attack begins within one


@pytest.mark.parametrize("name", ATTACKS)
def test_no_attack_throws_the_robot_or_leaves_a_limit(name):
    report = under_attack(ROBOT, ATTACKS[name], SECONDS)
    assert not report.fallen and report.tilt_rad < 0.1
    assert report.use.outside == (0, 0, 0)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32), st.floats(0.05, 5.0), st.integers(1, 60))
def test_what_is_approached_keeps_all_limits_wherever_it_jumps(seed, acceleration, held):
    rng = np.random.default_rng(seed)
    limits, fastest = np.array([[-1.0, 2.0], [0.0, 0.01]]), np.array([3.0, 0.5])
    strongest = np.array([acceleration, 10 * acceleration])
    here, velocity, path = np.array([0.0, 0.005]), np.zeros(2), []
    before = here
    for k in range(600):
        if k % held == 0:
            wanted = rng.uniform(-3, 3, 2)
        rate = (wanted - before) / PERIOD_S
        before = wanted
        bounds = Bounds(limits, fastest, strongest)
        here, velocity = approach(wanted, rate, here, velocity, bounds, PERIOD_S)
        path.append(here)
    speed = np.diff(path, axis=0) / PERIOD_S
    assert (np.array(path) >= limits[:, 0]).all() and (np.array(path) <= limits[:, 1]).all()
    assert (np.abs(speed) <= fastest + 1e-9).all()
    assert (np.abs(np.diff(speed, axis=0)) <= strongest * PERIOD_S + 1e-9).all()


def test_what_keeps_the_limits_is_followed_without_lag():
    time_s = PERIOD_S * np.arange(2000)
    wanted = np.column_stack((np.sin(time_s), 0.5 * np.cos(2 * time_s) - 0.5))
    one = np.ones(2)
    here, velocity, worst = wanted[0], np.zeros(2), []
    for before, now in itertools.pairwise(wanted):
        rate = (now - before) / PERIOD_S
        bounds = Bounds(np.array([[-2.0, 2.0]] * 2), 2 * one, 4 * one)
        here, velocity = approach(now, rate, here, velocity, bounds, PERIOD_S)
        worst.append(np.abs(here - now).max())
    assert max(worst[500:]) < 1e-9  # once it has caught up


def test_an_infeasible_posture_is_followed_as_far_as_the_legs_balance():
    """The oracle is the kinematics: feet, COG and base of the controller's reference."""
    reference = reference_robot(ROBOT)
    attacker = Attacker(ROBOT, 1)
    with Receiver(ROBOT, port=0) as receiver, Sender(ROBOT, port=receiver.port) as sender:
        lower = LowerBody(ROBOT, receiver, PERIOD_S)
        wanted = attacker.standing(roll=1.5)
        wanted[3], shares = 0.4, []
        for k in range(700):
            sender.send_bytes(attacker.datagram(wanted, k * PERIOD_S))
            lower.update(k * PERIOD_S)
            shares.append(lower.restraint.share)
    attacker.sender.close()
    found = lower.controller.reference
    assert 0.05 < found.target[1] < 0.5 and min(shares) < 1.0
    assert found.target[3] == pytest.approx(0.4, abs=1e-3)  # the upper body goes on
    height = found.target[0] + reference.stance_height - reference.standing_height
    turn = roll_pitch_matrix(found.target[1], found.target[2])
    miss = errors(reference.stance, forward(reference.tree, found.q), height, turn)
    assert np.abs(miss).max() < 3e-3


def test_restraint_leaves_alone_what_is_slow_and_balances():
    restraint = Restraint(ROBOT, PERIOD_S)
    rest = rest_reference(ROBOT).target
    bow = np.zeros_like(rest)
    bow[2] = 0.6
    path = [rest + bow * (0.5 - 0.5 * np.cos(np.pi * min(1.0, k / 500))) for k in range(600)]
    done = [restraint.update(posture) for posture in path]
    late = round(0.008 / PERIOD_S)
    np.testing.assert_allclose(done[late:], path[:-late], atol=2e-3)
    assert restraint.share == 1.0


@pytest.mark.parametrize("name", ["posture jumps", "shakes all at 1.5 Hz"])
def test_what_is_followed_changes_the_momentum_no_faster_than_its_bounds(name):
    """The oracle is MuJoCo: the momentum of the whole body, legs included."""
    restraint, attacker = Restraint(ROBOT, PERIOD_S), Attacker(ROBOT, 0)
    model, reference = ROBOT.model(), reference_robot(ROBOT)
    data = mujoco.MjData(model)
    momenta, before = [], restraint._q
    low, high = attacker.reference.limits.T
    for k in range(400):
        phase = np.sin(3 * np.pi * k * PERIOD_S) if "shakes" in name else (k // 100) % 2 * 2 - 1
        restraint.update(0.5 * (low + high) + 0.5 * (high - low) * phase)
        height, roll, pitch = restraint.position[:3]
        height += reference.stance_height - reference.standing_height
        here = restraint._q
        turn = roll_pitch_matrix(roll, pitch)
        here, miss = settle(reference.tree, reference.stance, here, height, turn, 1e-12, 20)
        assert miss < 1e-6
        data.qpos[:] = here
        mujoco.mj_differentiatePos(model, data.qvel, PERIOD_S, before, here)
        before = here
        mujoco.mj_forward(model, data)
        mujoco.mj_subtreeVel(model, data)
        lift = data.subtree_linvel[1][2] * model.body_subtreemass[1]
        momenta.append([*data.subtree_angmom[1], lift])
    attacker.sender.close()
    change = np.abs(np.diff(momenta, axis=0)) / PERIOD_S / restraint.bounds
    assert np.mean(change.max(axis=1)) > 0.2  # it is no slower than need be
    assert np.percentile(change, 95) < 1.05 and change.max() < 2.0


KEY = b"sixteen bytes or more"


def test_only_who_shares_the_key_is_followed():
    with Receiver(ROBOT, port=0, key=KEY) as receiver:
        options = {"port": receiver.port}
        with (
            Sender(ROBOT, **options, key=KEY) as friend,
            Sender(ROBOT, **options, key=KEY[::-1]) as other,
            Sender(ROBOT, **options) as stranger,
        ):
            attacker = Attacker(ROBOT, 0)
            base, angles = np.array([0.0, 0, 0.9, 1, 0, 0, 0]), attacker.rest[3:]
            attacker.sender.close()
            for sender in (other, stranger, friend):
                sender.send(base, angles, 0.0)
            assert len(receiver.receive(0.0)) == 1
            assert receiver.counts.foreign == 2 and receiver.counts.used == 1
            data = bytearray(friend.datagram(base, angles, 0.1))
            for place in range(len(data)):
                data[place] ^= 1
                assert receiver.take(bytes(data), 0.1) is None, place
                data[place] ^= 1
                assert receiver.take(bytes(data[:place]), 0.1) is None
            assert receiver.take(bytes(data), 0.1) is not None
        with Receiver(ROBOT, port=0) as keyless:
            assert keyless.take(bytes(data), 0.0) is None and keyless.counts.foreign == 1


def test_a_keyed_stream_cannot_be_replayed(monkeypatch):
    attacker = Attacker(ROBOT, 0)
    base, angles = np.array([0.0, 0, 0.9, 1, 0, 0, 0]), attacker.rest[3:]
    attacker.sender.close()
    with (
        Receiver(ROBOT, port=0, key=KEY, patience_s=0.5) as receiver,
        Sender(ROBOT, port=1, key=KEY) as first,
        Sender(ROBOT, port=1, key=KEY) as second,
    ):
        recorded = [first.datagram(base, angles, 0.1 * k, last=k == 4) for k in range(5)]
        assert all(receiver.take(data, 0.1 * k) for k, data in enumerate(recorded))
        assert not any(receiver.take(data, 2.0) for data in recorded)  # its own numbers
        later = second.datagram(base, angles, 0.0)
        assert receiver.take(later, 3.0)
        assert not any(receiver.take(data, 9.0) for data in recorded)  # the stream was left
        assert receiver.counts.stale == 5
    with Receiver(ROBOT, port=0, key=KEY) as anew:  # which remembers nothing
        import time

        now = time.time()
        monkeypatch.setattr(time, "time", lambda: now + 31.0)
        assert not any(anew.take(data, 0.0) for data in recorded)
        assert anew.counts.stale == 5


def test_keys_hosts_and_ports_are_checked(tmp_path, capsys):
    from mplearn.errors import InvalidValueError
    from mplearn_envs.link.sockets import LinkError

    for port in (-1, 65536, 10**30):
        with pytest.raises(InvalidValueError, match="UDP port"):
            Receiver(ROBOT, port=port)
        with pytest.raises(InvalidValueError, match="UDP port"):
            Sender(ROBOT, port=port)
    with pytest.raises(InvalidValueError, match="1 to 65535"):
        Sender(ROBOT, port=0)
    for host in ("no such host", "x" * 70, "a..b", "a\0b", "::1::2", "[::1]", "255.255.255.255"):
        with pytest.raises(LinkError, match="cannot send"):
            Sender(ROBOT, host)
    with pytest.raises(LinkError, match="cannot listen"):
        Receiver(ROBOT, "192.0.2.1", 0)
    with pytest.raises(InvalidValueError, match="16 bytes"):
        Sender(ROBOT, key=b"short")
    (tmp_path / "key").write_bytes(b"short\n")
    bad = [
        ["--port", "70000"], ["--port", "-1"], ["--host", "no such host"], ["--seed", "-1"],
        ["--key", str(tmp_path / "none")], ["--key", str(tmp_path / "key")], ["--speed", "nan"],
        ["--path", "no such primitive"],
    ]  # fmt: skip
    for options in bad:
        assert main(["upper", *options]) == 2, options
        assert capsys.readouterr().err.startswith("error: ")
    assert main(["lower", "--seconds", "-5"]) == 2
    assert main(["attacks", "--seconds", "nan"]) == 2
    capsys.readouterr()


def test_the_link_runs_over_ipv6():
    import socket

    try:
        with socket.socket(socket.AF_INET6, socket.SOCK_DGRAM) as probe:
            probe.bind(("::1", 0))
    except OSError:
        pytest.skip("this machine has no IPv6")
    with Receiver(ROBOT, "::1", 0) as receiver, Sender(ROBOT, "::1", receiver.port) as sender:
        UpperBody(ROBOT, sender).update(np.zeros(len(ROBOT.channels)), 0.0)
        assert len(receiver.receive(0.0)) == 1
