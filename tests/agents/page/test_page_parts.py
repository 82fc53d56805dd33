"""The parts of the page that need neither server nor browser."""

import itertools
import json
import struct
import threading
import time
import warnings
from multiprocessing import Pipe

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from little_room import little_room

from benchmarks.teaching_session import until
from mplearn.body import human_body, posture_of, robot_body
from mplearn.demonstrator import demonstrate
from mplearn.errors import InvalidValueError, LibraryError
from mplearn.learner import LearnerConfig, MotionLearner
from mplearn.maths.rotations import quaternion_to_matrix
from mplearn.sources import Block, BufferedSource, Source, Stream, Tally
from mplearn.store import LifelongLearner
from mplearn_agents.page import messages, teaching, watching
from mplearn_agents.page.figures import CLIP_HZ, has_figure, human_poses, poses_of, shapes_of
from mplearn_agents.page.happenings import tell
from mplearn_agents.page.knowledge import knowledge
from mplearn_agents.page.outbox import Outbox
from mplearn_agents.page.performing import Stage
from mplearn_agents.page.shelf import Receiver, Sender
from mplearn_agents.page.watched_figure import WatchedFigure
from mplearn_agents.page.watching import Watch, Watcher

SCRIPT = ("BAR", "BAL", "BAD", "BAU") * 5


@pytest.fixture(scope="module")
def shown():
    return demonstrate(SCRIPT, 2)


@pytest.fixture(scope="module")
def taught(shown):
    """A learner that has seen four primitives, and what it said."""
    recording = shown.recording
    life = LifelongLearner(MotionLearner(LearnerConfig(recording.channels, recording.rate_hz)))
    events = life.learn_many(recording.frames) + life.end_stream()
    return life, events


# ---- messages


@given(st.dictionaries(st.text(), st.text() | st.integers() | st.none()), st.binary())
def test_messages_survive_the_way(header, blob):
    assert messages.unpack(messages.pack(header, blob)) == (header, blob)


def test_any_name_at_all_can_be_sent():
    text = messages.as_text({"name": "\ud800 \u2028 </script>"})
    assert text.isascii() and json.loads(text)["name"].startswith("\ud800")


def test_what_is_not_a_number_is_never_sent():
    with pytest.raises(ValueError, match="JSON"):
        messages.as_text({"x": float("nan")})


@pytest.mark.parametrize("name", ["\u05d0\u2066", "\u2067\u2067x", "\u05d0", "\u05d0\u2069"])
def test_what_is_written_backward_is_kept_apart_to_its_end(name):
    """Isolates that a name begins and does not end, or ends, would reach beyond it."""
    text = messages.literal(name)
    assert (text[0], text[-1]) == ("\u2068", "\u2069")
    assert not set(text[1:-1]) & set("\u2066\u2067\u2068\u2069")


def test_a_clip_says_how_long_each_motion_is():
    motions = [np.random.default_rng(k).normal(size=(n, 3, 7)) for k, n in enumerate((4, 2))]
    data = messages.clip(9, 30.0, motions)
    kind, _, bodies, number, rate_hz, n = struct.unpack_from("<BBHIfI", data)
    assert (kind, bodies, number, rate_hz, n) == (messages.CLIP, 3, 9, 30.0, 2)
    assert np.frombuffer(data, "<u4", 2, 16).tolist() == [4, 2]
    values = np.frombuffer(data, "<f4", offset=24)
    np.testing.assert_array_equal(values, np.concatenate(motions).ravel().astype(np.float32))


# ---- figures


def test_poses_are_those_of_mujoco():
    import mujoco

    body = human_body()
    model, rng = body.model(), np.random.default_rng(0)
    data = mujoco.MjData(model)
    q = np.tile(body.rest, (5, 1))
    q[:, 7:] += rng.uniform(-0.4, 0.4, (5, body.nq - 7))
    for posture, pose in zip(q, poses_of(body.tree, q), strict=True):
        data.qpos[:] = posture
        mujoco.mj_kinematics(model, data)
        np.testing.assert_allclose(pose[:, :3], data.xpos[1:], atol=1e-6)
        same = np.abs(np.sum(pose[:, 3:] * data.xquat[1:], axis=1))
        np.testing.assert_allclose(same, 1.0, atol=1e-6)


def test_every_shape_belongs_to_a_body():
    for body in (human_body(), robot_body()):
        shapes = shapes_of(body.model())
        assert len(shapes) > 20
        assert {s["body"] for s in shapes} <= set(range(len(body.tree.body_names)))
        json.dumps(shapes, allow_nan=False)


def test_the_human_figure_does_what_the_robots_features_say():
    """Arms point where the robot's do, and the soles stay on the floor."""
    robot, human = robot_body(), human_body()
    rng = np.random.default_rng(1)
    features = np.zeros((6, 3 + len(robot.driven)))
    features[:, 0] = robot.rest[2]
    names = list(robot.driven_names)
    for joint in ("shoulder_pitch_l", "elbow_r", "shoulder_roll_r"):
        low, high = robot.joint_limits[robot.joint_names.index(joint)]
        features[:, 3 + names.index(joint)] = rng.uniform(max(low, -1), min(high, 1), 6)
    channels = ("base_height", "base_roll", "base_pitch", *names)
    assert has_figure(channels) and not has_figure(channels[:-1])
    figure = human_poses(features, channels)
    for pose, posture in zip(figure, posture_of(features), strict=True):
        _, meant = robot.tree.forward(posture)
        for part in ("upper_arm_l", "forearm_r", "thigh_l", "head"):
            mine = quaternion_to_matrix(pose[human.tree.body(part), 3:].astype(float))
            np.testing.assert_allclose(mine, meant[robot.tree.body(part)], atol=1e-5)
        hand, forearm, foot = (human.tree.body(n) for n in ("hand_l", "forearm_l", "foot_l"))
        length = np.linalg.norm(pose[hand, :3] - pose[forearm, :3])
        assert abs(length - np.linalg.norm(human.tree.offset[hand])) < 1e-5
        standing = poses_of(human.tree, human.rest[None])[0]
        assert abs(pose[foot, 2] - standing[foot, 2]) < 1e-3


def test_the_watched_person_stands_like_the_demonstrator(shown):
    recording = shown.recording
    figure = WatchedFigure(recording.channels, recording.rate_hz)
    rows = [figure.take(recording.frames[t : t + 7]) for t in range(0, 700, 7)]
    assert figure.stride == 2 and sum(map(len, rows)) == 350  # in blocks of any size, every second
    truth = poses_of(human_body().tree, shown.posture.frames[698:699])[0]
    hands = [human_body().tree.body(f"hand_{side}") for side in "lr"]
    for hand in hands:
        above = figure.pose[hand, 2] - figure.pose[0, 2], truth[hand, 2] - truth[0, 2]
        assert abs(above[0] - above[1]) < 0.08


# ---- the library, from process to process


def test_only_what_has_changed_is_sent(taught):
    life, _ = taught
    sender, receiver = Sender(), Receiver()
    first = sender.send(life.snapshot())
    got = receiver.receive(*first)
    assert got.ids == life.snapshot().ids and got.names == life.snapshot().names
    np.testing.assert_array_equal(got.graph.edge_rows(), life.snapshot().graph.edge_rows())
    id = got.ids[0]
    life.execute(teaching.COMMANDS["rename"]({"id": id, "name": "arms"}))
    second = sender.send(life.snapshot())
    assert len(second[1]) < 0.6 * len(first[1])
    again = receiver.receive(*second)
    assert again[id].name == "arms" and again.ids == got.ids
    for one, two in zip(again.primitives, life.snapshot().primitives, strict=True):
        np.testing.assert_array_equal(one.hmm.means, two.hmm.means)
    life.undo()
    with pytest.raises(LibraryError, match="never delivered"):
        Receiver().receive(*second)
    sender.forget()
    assert Receiver().receive(*sender.send(life.snapshot())).ids == got.ids


# ---- what is known, and what happened


def test_knowledge_is_the_librarys(taught):
    life, _ = taught
    library, told = life.snapshot(), knowledge(life.snapshot(), life.learner.tree)
    assert [p["id"] for p in told["primitives"]] == list(library.ids)
    leaves = {n["id"] for n in told["nodes"]} - {n["parent"] for n in told["nodes"]}
    assert leaves == set(library.ids)
    for source, target, count, p, duration_s in told["edges"]:
        assert count == library.graph.count(source, target)
        row = dict(zip(library.graph.ids, library.graph.prior(source), strict=True))
        assert p == pytest.approx(row[target], abs=1e-4)
        assert duration_s == pytest.approx(library.graph.duration_s(source, target), abs=2e-3)
    json.dumps(told, allow_nan=False)
    long = knowledge(library.rename(library.ids[0], "a" * 10_000), life.learner.tree)
    assert long["primitives"][0]["name"] == "a" * 199 + "\u2026"  # a page would draw at 0.1 Hz


def test_every_segment_is_told_with_what_became_of_it(taught):
    life, events = taught
    told = list(tell(events, 100.0))
    segments = [m for m in told if m["kind"] == "segment"]
    assert all(a["end"] <= b["start"] for a, b in itertools.pairwise(segments))
    assert sum(m["state"] == "known" for m in segments) >= 8
    born = [m["primitive"] for m in told if m["kind"] == "event" and m["what"] == "born"]
    assert set(life.snapshot().ids) <= set(born)
    assert any(m["state"] == "unlike" and m["why"] for m in segments)
    json.dumps(told, allow_nan=False)


# ---- what teachers ask


UNFIT = (
    '{"do":"walk","length":1e999}', '{"do":"undo","ref":NaN}', '{"do":1}', "[]", "9" * 5000,
    "[" * 8000, '{"do":' * 1000, '{"do":"note","text":"' + "x" * 8192 + '"}',
)  # fmt: skip


@pytest.mark.parametrize("text", UNFIT)
def test_what_cannot_be_passed_on_is_refused(text):
    with pytest.raises(InvalidValueError, match="a request"):
        messages.request(text)


def test_each_request_is_a_command_and_can_be_undone(taught):
    life, _ = taught
    a, b = life.snapshot().ids[:2]
    before = life.snapshot().ids, life.snapshot().names
    for asked in (
        {"do": "rename", "id": a, "name": "  raise "},
        {"do": "merge", "id": a, "other": b},
        {"do": "forget", "id": b},
        {"do": "freeze", "id": a},
        {"do": "note", "id": a, "text": "slow"},
        {"do": "pause"},
    ):
        said, entry = teaching.do(life, asked, "Anna")
        assert said
        assert life.reversible()[-1] == entry
        named = {"entry": entry} if asked["do"] != "pause" else {}  # that, or the latest
        assert teaching.do(life, {"do": "undo"} | named, "Bob")[0].startswith("undone: ")
        assert life.reversible(undone=True)[-1] == entry
    assert (life.snapshot().ids, life.snapshot().names) == before
    assert not life.learner.paused
    lines = teaching.history(life, {"id": a})
    assert any("Anna" in line["text"] and "undone" in line["text"] for line in lines)
    said, _ = teaching.do(life, {"do": "rename", "id": a, "name": "{7}"}, "Anna")
    assert said.endswith("is called {{7} now")  # which stands for no primitive
    said, _ = teaching.do(life, {"do": "undo"}, "Anna")
    assert said == f"undone: {before[1][0]} is called {{{{7}} now"
    said, _ = teaching.do(life, {"do": "redo"}, "Anna")
    assert said == f"done again: P{a} is called {{{{7}} now"  # not: {7} is called {7}
    teaching.do(life, {"do": "undo"}, "Anna")


@pytest.mark.parametrize(
    "asked",
    [
        {"do": "rename", "id": "1", "name": "x"},
        {"do": "rename", "id": 1, "name": "x" * 81},
        {"do": "rename", "id": 1, "name": "a\x1b[31m"},
        {"do": "rename", "id": True, "name": "x"},
        {"do": "merge", "id": 1},
        {"do": "forget", "id": -1},
        {"do": "note", "id": 1, "text": None},
        {"do": "open the pod bay doors"},
        {"do": "undo", "entry": "last"},
        {"do": "undo", "entry": 10**6},
        {"do": "redo", "entry": None},
    ],
)
def test_what_is_asked_wrongly_changes_nothing(taught, asked):
    life, _ = taught
    revision = life.revision
    with pytest.raises(InvalidValueError):
        teaching.do(life, asked, "Anna")
    assert life.revision == revision


# ---- sending and performing


def test_who_reads_slowly_gets_the_latest_of_each_kind():
    mine, theirs = Pipe()
    outbox = Outbox(mine)
    for k in range(2000):
        outbox.post({"kind": "pose", "k": k}, b"x" * 4000, key="pose")
    outbox.post({"kind": "event"})
    got = []
    while not got or got[-1]["kind"] != "event":
        got.append(messages.unpack(theirs.recv_bytes())[0])
    poses = [m["k"] for m in got[:-1]]
    assert poses == sorted(poses) and poses[-1] == 1999 and len(poses) < 1500
    theirs.close()
    outbox.post({"kind": "event"})
    outbox.close()
    assert outbox.broken


class Kept:
    """An outbox that keeps what is posted."""

    broken = False

    def __init__(self):
        self.posted = []

    def post(self, header, blob=b"", key=None):
        self.posted.append((header, blob))

    def post_later(self, make, key):
        pass


def test_a_click_shows_the_figure_with_its_demonstrations(taught):
    """The learner answers: its own library, as it was told last, whatever the robot does."""
    life, _ = taught
    mine, theirs = Pipe()
    kept = Kept()
    watcher = Watcher(Watch("demonstrator"), mine, kept)
    asked = {"do": "show", "client": 1, "id": life.snapshot().ids[0], "ref": 7}
    watcher._answer(asked)  # nothing was told yet
    watcher._lifelong = life
    while not any(h["kind"] == "library" for h, _ in kept.posted):
        watcher._tell_knowledge()
    watcher._answer(asked)
    watcher._answer(asked | {"id": 10**6})
    replies = [h for h, _ in kept.posted if h["kind"] == "reply"]
    assert [h["ok"] for h in replies] == [False, True, False]
    (blob,) = (blob for h, blob in kept.posted if h["kind"] == "clip")
    primitive = life.snapshot()[asked["id"]]
    assert np.frombuffer(blob, "<u4", 1, 4)[0] == 7
    (n,) = np.frombuffer(blob, "<u4", 1, 12)
    assert n == 1 + len(primitive.exemplars)
    lengths = np.frombuffer(blob, "<u4", n, 16)
    seconds = np.array([len(each) for each in primitive.exemplars]) / life.snapshot().rate_hz
    np.testing.assert_allclose(lengths[1:] / CLIP_HZ, seconds, atol=0.5 / CLIP_HZ)
    poses = np.frombuffer(blob, "<f4", offset=16 + 4 * n).reshape(lengths.sum(), -1, 7)
    assert 0.5 < poses[:, 0, 2].min() < poses[:, 0, 2].max() < 1.3  # the pelvis
    theirs.close()


def test_frames_that_cannot_be_learned_cost_nothing_else():
    """A source of somebody else that breaks what it promised."""
    mine, theirs = Pipe()
    kept = Kept()
    watcher = Watcher(Watch("mine"), mine, kept)

    def block(*channels):
        times = np.arange(10) / 100.0
        stream = Stream(channels, 100.0)
        return Block(stream, np.zeros((10, len(channels))), times, times)

    for each in (block("a", "b"), block("a"), block("a", "b")):
        watcher._try(each)
    assert watcher._lifelong.n_frames == 20
    assert abs(watcher._lifelong.state().chunk_when - time.time()) < 60  # dated by the clock
    assert any("10 frames were not learned" in str(h.get("text")) for h, _ in kept.posted)
    theirs.close()


class Given(Source):
    """A source that has all at once, and breaks or ends after that."""

    def __init__(self, frames, error=None):
        self.name, self.tally, self._error = "given:", Tally(), error
        times_s = np.arange(len(frames)) / 100.0
        stream = Stream(("a", "b"), 100.0)
        self._blocks = [
            Block(stream, frames[i : i + 1], times_s[i : i + 1], times_s[i : i + 1])
            for i in range(len(frames))
        ]

    @property
    def ended(self):
        return not self._blocks and self._error is None

    def read(self, timeout_s=None):
        if not self._blocks:
            raise self._error
        return [self._blocks.pop(0)]

    def close(self):
        self._blocks.clear()


@pytest.mark.parametrize("error", [None, RuntimeError("the cable is out")])
def test_what_waits_is_learned_in_order_and_teachers_come_first(error):
    mine, theirs = Pipe()
    kept = Kept()
    watcher = Watcher(Watch("mine"), mine, kept)
    t = np.arange(800) / 100.0
    swing = np.where(t % 2 < 1, np.sin(np.pi * t) ** 2, 0.0)[:, None] * [1.0, 0.5]
    source = Given(swing, error)
    with BufferedSource(source, arrived=watcher._arrived) as waiting:
        watcher._source = waiting
        while source._blocks:
            time.sleep(0.01)
        watcher._put(watching._TEACHERS, "request", {"do": "history", "id": 1, "ref": 1})
        watcher._step()
        assert [h["kind"] for h, _ in kept.posted if h["kind"] == "reply"] == ["reply"]
        assert watcher._lifelong is None
        assert watcher._status()["behind_s"] >= 7.9
        while not watcher._over:
            assert watcher._step()
        assert watcher._status()["behind_s"] == 0.0
    learner = MotionLearner(LearnerConfig(("a", "b"), 100.0))
    learner.learn_many(swing)
    if error is None:
        learner.end_stream()
    assert watcher._state == ("ended" if error is None else "broken")
    assert watcher._lifelong.learner.state() == learner.state()
    theirs.close()


def test_on_a_full_disk_the_page_says_so_and_all_is_kept_once_there_is_room(tmp_path):
    mine, theirs = Pipe()
    kept = Kept()
    path = tmp_path / "life.db"
    watcher = Watcher(Watch("mine", store=str(path)), mine, kept)
    rng = np.random.default_rng(0)
    stream = Stream(("a", "b"), 100.0)
    blocks = [
        Block(stream, rng.normal(size=(50, 2)), k / 2 + np.arange(50) / 100.0, np.zeros(50))
        for k in range(60)
    ]

    def full():
        return "full" in watcher._status()["problem"] or "I/O" in watcher._status()["problem"]

    with warnings.catch_warnings():
        warnings.simplefilter("always")
        warnings.showwarning = watcher._warned
        watcher._try(blocks.pop(0))
        with little_room(200_000):
            while not full():
                watcher._try(blocks.pop(0))
                assert blocks, "the disk is not full"
            for _ in range(5):
                watcher._try(blocks.pop(0))  # learning goes on
        until(lambda: not watcher._status()["problem"], 60.0, "written again")
    said = [h["text"] for h, _ in kept.posted if h.get("what") == "store"]
    assert len(said) == 1 and "learning goes on in memory" in said[0]
    n_frames = watcher._lifelong.n_frames
    state = watcher._lifelong.learner.state()
    watcher._lifelong.close()
    with LifelongLearner.open(path) as again:
        assert again.n_frames == n_frames
        assert again.learner.state() == state
    theirs.close()


def test_the_robot_performs_what_it_is_asked(taught):
    """The robot in MuJoCo: a primitive, then a path."""
    life, _ = taught
    mine, theirs = Pipe()
    kept = Kept()
    stage = Stage(mine, kept)
    library = life.snapshot()
    delivery = Sender().send(library)

    def ask(what, **values):
        theirs.send_bytes(messages.pack({"kind": "ask", "do": what, "client": 1} | values))

    theirs.send_bytes(messages.pack({"kind": "library", "content": delivery[0]}, delivery[1]))
    running = threading.Thread(target=stage.run)
    running.start()
    ask("perform", id=library.ids[0], ref=8)
    ask("walk", length=0, ref=9)
    ask("path", id=10**6, ref=10)

    def performed():
        return {h["primitive"] for h, _ in kept.posted if h["kind"] == "robot"} - {None}

    until(performed, 200)  # compiling, the first time
    assert performed() == {library.ids[0]}
    ask("path", id=library.ids[1], ref=11)
    until(lambda: library.ids[1] in performed(), 60)
    theirs.close()
    running.join(10)
    replies = {h["ref"]: h for h, _ in kept.posted if h["kind"] == "reply"}
    assert replies[8]["ok"] and replies[11]["ok"]
    assert not replies[9]["ok"] and "1 to" in replies[9]["text"]
    assert not replies[10]["ok"]
    assert library.ids[1] in performed()
    poses = [blob for h, blob in kept.posted if h["kind"] == "robot-pose"]
    heights = [np.frombuffer(p, np.float32).reshape(-1, 7)[0, 2] for p in poses]
    assert len(poses) > 50 and min(heights) > 0.5  # it stands
