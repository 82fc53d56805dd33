"""VMC: the bones of a VRM avatar by OSC over UDP, as virtual motion capture sends them [VMC].

Positions and rotations are local, in Unity's axes (x right, y up, z forward, left-handed), metres.
"""

from __future__ import annotations

import logging
from typing import Any

import numpy as np

from ...extras import require
from ...maths.rotations import quaternion_to_matrix
from ...recording import FloatArray
from ..inbox import Inbox, Sample
from ..received import ReceivedSource
from ..registry import Wanted
from ..source import Source, Stream
from .addresses import LOOPBACK, host_and_port
from .datagrams import DatagramReceiver
from .skeletons import points_of, with_axes

EXTRA = "live"
PORT = 39539
PARENTS = {
    "Hips": "",
    "Spine": "Hips",
    "Chest": "Spine",
    "UpperChest": "Chest",
    "Neck": "UpperChest",
    "Head": "Neck",
    **{
        f"{side}{bone}": parent if parent in ("Hips", "UpperChest") else f"{side}{parent}"
        for side in ("Left", "Right")
        for bone, parent in (
            ("Shoulder", "UpperChest"),
            ("UpperArm", "Shoulder"),
            ("LowerArm", "UpperArm"),
            ("Hand", "LowerArm"),
            ("UpperLeg", "Hips"),
            ("LowerLeg", "UpperLeg"),
            ("Foot", "LowerLeg"),
            ("Toes", "Foot"),
        )
    },
}
"""The bones of the body, without fingers and face, and what each hangs on, parents first."""
ROOT = ""
FROM_UNITY = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""From x right, y up, z forward to x forward, y left, z up."""
_FEWEST = 8  # bones


def open_vmc(address: str, wanted: Wanted) -> Source:
    """Bones of an avatar by VMC (VSeeFace, mocopi, ...): ``vmc:[HOST:]PORT``, where we listen."""
    receiver = VMCReceiver(host_and_port(address, PORT, host=LOOPBACK))
    return ReceivedSource(f"vmc:{receiver.address}", receiver, wanted.hints.rate_hz)


class VMCReceiver(DatagramReceiver):
    """Gathers the bones of a frame, whichever way its messages are packed.

    A frame is whole when all bones of the frames before are there, or when one comes again.

    Raises:
        MissingDependencyError: python-osc is not installed.
    """

    def __init__(self, address: tuple[str, int]) -> None:
        self._osc = require("pythonosc.osc_packet", EXTRA)
        log = logging.getLogger("pythonosc")
        log.disabled = True  # by the root's it would print whatever comes in
        for name in ("osc_bundle", "osc_message"):
            module: Any = require(f"pythonosc.{name}", EXTRA)
            module.logging = log
        super().__init__(address)
        self._bones: dict[str, tuple[float, ...]] = {}
        self._time_s: float | None = None  # as was said last
        self._frame_s: float | None = None  # of the frame that is gathered
        self._stream: Stream | None = None
        self._names: tuple[str, ...] = ()
        self._parents: tuple[int, ...] = ()

    def take(self, data: bytes, sender: tuple[str, int], arrived_s: float, inbox: Inbox) -> None:
        """Take a datagram: a message, or a bundle of them."""
        try:
            messages = [each.message for each in self._osc.OscPacket(data).messages]
        except Exception as error:  # its own errors, and others of what it does not check
            raise ValueError(f"no OSC: {error}") from None
        for message in messages:
            if message.address == "/VMC/Ext/T":
                self._time_s = float(message.params[0])
            elif message.address in ("/VMC/Ext/Bone/Pos", "/VMC/Ext/Root/Pos"):
                name = message.params[0] if message.address.startswith("/VMC/Ext/Bone") else ROOT
                pose = tuple(float(each) for each in message.params[1:8])
                if len(pose) < 7:
                    raise ValueError(f"a bone has 7 numbers, not {len(pose)}")
                if name != ROOT and name not in PARENTS:
                    continue
                if name in self._bones:
                    self._send(arrived_s, inbox)
                if not self._bones:
                    self._frame_s = self._time_s
                self._bones[name] = pose
        if self._names and len(self._bones) > len(self._names):
            self._send(arrived_s, inbox)

    def _send(self, arrived_s: float, inbox: Inbox) -> None:
        """Hand on the frame that was gathered."""
        bones, self._bones = self._bones, {}
        root = bones.pop(ROOT, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0))
        new = [name for name in PARENTS if name in bones and name not in self._names]
        if self._stream is None or new:
            if len(bones) < _FEWEST or "Hips" not in bones:
                inbox.say("names", f"a frame of {len(bones)} bones, too few for a body", 1)
                return
            self._describe(bones)
        assert self._stream is not None
        values = self._points(bones, root)
        time_s = arrived_s if self._frame_s is None else self._frame_s
        inbox.put(Sample(self._stream, values, arrived_s, time_s=time_s))

    def _describe(self, bones: dict[str, tuple[float, ...]]) -> None:
        self._names = tuple(name for name in PARENTS if name in bones or name in self._names)
        at = {name: i for i, name in enumerate(self._names)}
        parents = []
        for name in self._names:
            above = PARENTS[name]
            while above and above not in at:
                above = PARENTS[above]
            parents.append(at[above] if above else -1)
        self._parents = tuple(parents)
        places = np.array([bones.get(name, (0.0,) * 7)[:3] for name in self._names]) @ FROM_UNITY.T
        channels, skeleton = with_axes(self._names, self._parents, places, 1.0)
        self._stream = Stream(channels, 0.0, skeleton, 1.0, "z")

    def _points(self, bones: dict[str, tuple[float, ...]], root: tuple[float, ...]) -> FloatArray:
        """Return where the joints are, and points on their axes."""
        missing = (np.nan,) * 7
        poses = np.array([root, *(bones.get(name, missing) for name in self._names)])
        local = FROM_UNITY @ quaternion_to_matrix(poses[:, [6, 3, 4, 5]]) @ FROM_UNITY.T
        steps = poses[:, :3] @ FROM_UNITY.T
        places, turns = np.empty((len(steps), 3)), np.empty((len(steps), 3, 3))
        places[0], turns[0] = steps[0], local[0]
        for index, parent in enumerate(self._parents, start=1):
            above = parent + 1
            places[index] = places[above] + turns[above] @ steps[index]
            turns[index] = turns[above] @ local[index]
        return points_of(places[1:], turns[1:], 1.0)
