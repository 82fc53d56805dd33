"""A person's postures written as BVH files of many dialects: what any recogniser must see through.

A rig is the human body hung on a skeleton with its own names, zero pose, spine, extra joints, unit
and axes. Whatever it is, the person in it does the same.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from mplearn.body.models.body import Body

LAFAN = {
    "pelvis": "Hips",
    "abdomen": "Spine",
    "chest": "Spine1",
    "head": "Neck",
    "clavicle": "{Left|Right}Shoulder",
    "upper_arm": "{Left|Right}Arm",
    "forearm": "{Left|Right}ForeArm",
    "hand": "{Left|Right}Hand",
    "thigh": "{Left|Right}UpLeg",
    "shank": "{Left|Right}Leg",
    "foot": "{Left|Right}Foot",
    "toes": "{Left|Right}Toe",
}
NAMES = {
    "lafan": LAFAN,
    "mixamo": {part: name.replace("{", "mixamorig:{") for part, name in LAFAN.items()}
    | {"pelvis": "mixamorig:Hips", "toes": "mixamorig:{Left|Right}ToeBase"},
    "cgspeed": LAFAN
    | {
        "clavicle": "{Left|Right}Collar",
        "upper_arm": "{Left|Right}Shoulder",
        "forearm": "{Left|Right}Elbow",
        "hand": "{Left|Right}Wrist",
        "thigh": "{Left|Right}Hip",
        "shank": "{Left|Right}Knee",
        "foot": "{Left|Right}Ankle",
    },
    "bandai": {
        "pelvis": "Hips",
        "abdomen": "Spine",
        "chest": "Chest",
        "head": "Neck",
        "clavicle": "Shoulder_{L|R}",
        "upper_arm": "UpperArm_{L|R}",
        "forearm": "LowerArm_{L|R}",
        "hand": "Hand_{L|R}",
        "thigh": "UpperLeg_{L|R}",
        "shank": "LowerLeg_{L|R}",
        "foot": "Foot_{L|R}",
        "toes": "Toes_{L|R}",
    },
    "mocapnet": {
        "pelvis": "hip",
        "abdomen": "abdomen",
        "chest": "chest",
        "head": "neck",
        "clavicle": "{l|r}Collar",
        "upper_arm": "{l|r}Shldr",
        "forearm": "{l|r}ForeArm",
        "hand": "{l|r}Hand",
        "thigh": "{l|r}Thigh",
        "shank": "{l|r}Shin",
        "foot": "{l|r}Foot",
        "toes": "toe_{l|r}",
    },
    "biped": {
        part: f"Bip01_{'' if part in ('pelvis', 'abdomen', 'chest', 'head') else '{L|R}_'}{part}"
        for part in LAFAN
    },
    "numbers": {part: f"joint{7 * i}{'{a|b}' if i > 3 else ''}" for i, part in enumerate(LAFAN)},
    "german": {part: f"{'' if i < 4 else '{links|rechts}_'}{i}" for i, part in enumerate(LAFAN)},
}


# what hangs on which part: chains of places [m] on it, those with a side on both
COSTUMES = {
    "hair": ("head", [(0, 0.07, 0.2), (0, 0.1, 0.1), (-0.05, 0.1, -0.2), (-0.05, 0.1, -0.4)]),
    "skirt": ("pelvis", [(0.08, 0.1, -0.02), (0.11, 0.14, -0.25), (0.14, 0.17, -0.6)]),
    "tail": ("pelvis", [(-0.1, 0, 0), (-0.3, 0, -0.1), (-0.6, 0, -0.2), (-0.9, 0, -0.15)]),
    "staff": ("chest", [(-0.15, 0, 0), (-0.15, 0.4, 0.6), (-0.15, 0.6, 1.0)]),
    "wings": ("chest", [(-0.1, 0.05, 0.15), (-0.2, 0.4, 0.4), (-0.2, 0.9, 0.5), (-0.2, 1.3, 0.3)]),
    "high": ("chest", [(-0.1, 0.05, 0.15), (-0.2, 0.3, 0.5), (-0.25, 0.6, 0.7), (-0.2, 1.1, 0.9)]),
    "ears": ("head", [(0, 0.04, 0.22), (0, 0.06, 0.35), (0, 0.07, 0.5)]),
    "flag": ("chest", [(-0.15, 0, 0.1), (-0.2, 0, 0.8), (-0.2, 0, 1.6)]),
}  # fmt: skip


@dataclass(frozen=True)
class Rig:
    """How a person is written.

    Attributes:
        names: Key of `NAMES`.
        zero: The zero pose: "hang", "T", "A", "lying", "sitting" or "odd"; with "bones", each bone
            lies along the x axis of its own, as animation programs have it.
        order: Order of the rotation channels.
        spine: Joints between hips and neck; 2 are the body's own.
        bends: Whether a longer spine shares out the bends, instead of having stiff joints.
        without: Parts left out: "clavicle", "toes", "ends".
        fingers, twists, helpers, face, prop: Joints that no body needs.
        costume: Keys of `COSTUMES`, chains of joints that hang on trunk or head.
        metacarpals: Whether each finger begins with a joint near the wrist.
        unit_m: Length of the file's unit [m].
        up: The file's vertical axis.
        yaw: Heading of the whole recording [rad].
        reverse: Whether the right side is written first.
    """

    names: str = "lafan"
    zero: str = "T"
    order: str = "ZYX"
    spine: int = 2
    bends: bool = False
    without: tuple[str, ...] = ()
    fingers: bool = False
    metacarpals: bool = False
    twists: bool = False
    helpers: bool = False
    face: bool = False
    prop: bool = False
    costume: tuple[str, ...] = ()
    unit_m: float = 0.01
    up: str = "y"
    yaw: float = 0.0
    reverse: bool = False

    def __str__(self) -> str:
        other = [f"{k}={v}" for k, v in vars(self).items() if v != getattr(Rig, k, None)]
        return " ".join(other) or "plain"


@dataclass
class _Node:
    name: str
    parent: int
    pos: np.ndarray  # (T, 3)
    mat: np.ndarray  # (T, 3, 3)
    is_end: bool = False
    children: list[int] = field(default_factory=list)


def write_rig(path: Path, body: Body, postures: np.ndarray, rate_hz: float, rig: Rig) -> Path:
    """Write postures (T, 7 + n) of a body as BVH."""
    nodes = _nodes(body, postures, rig)
    rest = _nodes(body, _zero_pose(body, rig.zero)[None], rig)
    if rig.zero == "bones":
        _along_bones(rest)
    axes = {"y": [[0, 1, 0], [0, 0, 1], [1, 0, 0]], "z": np.eye(3), "x": np.roll(np.eye(3), 1, 0)}
    to_file = np.array(axes[rig.up], dtype=float)
    to_file = to_file @ Rotation.from_euler("z", rig.yaw).as_matrix()
    for k, node in enumerate(nodes):
        if node.parent >= 0:
            nodes[node.parent].children.append(k)
    turns = [n.mat @ r.mat[0].T for n, r in zip(nodes, rest, strict=True)]
    lines, values = ["HIERARCHY"], []

    def write(k: int, depth: int) -> None:
        node, indent = nodes[k], "\t" * depth
        offset = np.zeros(3) if node.parent < 0 else rest[k].pos[0] - rest[node.parent].pos[0]
        offset = to_file @ offset / rig.unit_m
        word = "ROOT" if node.parent < 0 else "JOINT"
        lines.append(indent + ("End Site" if node.is_end else f"{word} {node.name}"))
        lines.append(indent + "{")
        lines.append(indent + "\tOFFSET " + " ".join(f"{x:.6f}" for x in offset))
        if not node.is_end:
            local = (
                turns[k] if node.parent < 0 else turns[node.parent].transpose(0, 2, 1) @ turns[k]
            )
            local = to_file @ local @ to_file.T
            angles = Rotation.from_matrix(local).as_euler(rig.order, degrees=True)
            position = "Xposition Yposition Zposition " if node.parent < 0 else ""
            channels = position + " ".join(f"{axis}rotation" for axis in rig.order)
            lines.append(f"{indent}\tCHANNELS {len(channels.split())} {channels}")
            if node.parent < 0:
                values.append(node.pos @ to_file.T / rig.unit_m)
            values.append(angles)
        for child in node.children:
            write(child, depth + 1)
        lines.append(indent + "}")

    write(0, 0)
    table = np.concatenate(values, axis=1)
    lines += ["MOTION", f"Frames: {len(table)}", f"Frame Time: {1 / rate_hz:.8f}"]
    lines += [" ".join(f"{x:.6f}" for x in row) for row in table]
    path.write_text("\n".join(lines) + "\n")
    return path


def _zero_pose(body: Body, name: str) -> np.ndarray:
    q = body.rest
    degrees = {
        "hang": {},
        "T": {"shoulder_roll": 90},
        "bones": {},
        "A": {"shoulder_roll": 45},
        "lying": {"shoulder_roll": 20},
        "sitting": {"hip_pitch": -90, "knee": 90, "shoulder_roll": 30},
        "odd": {"hip_pitch": -60, "knee": 100, "shoulder_pitch": -80, "elbow": -90},
    }[name]
    for joint, angle in degrees.items():
        for side, sign in (("l", 1), ("r", -1 if joint.endswith(("roll", "yaw")) else 1)):
            q[7 + body.joint_names.index(f"{joint}_{side}")] = np.radians(sign * angle)
    if name == "odd":
        q[7 + body.joint_names.index("lumbar_pitch")] = np.radians(40)
    if name == "lying":
        q[3:7] = Rotation.from_euler("y", -90, degrees=True).as_quat(scalar_first=True)
    return q


def _along_bones(rest: list[_Node]) -> None:
    """Turn each bone of a zero pose to x, those of the right side to -x."""
    old = [(node.pos[0].copy(), node.mat[0].copy()) for node in rest]
    for k, node in enumerate(rest):
        below = next((c for c, child in enumerate(rest) if child.parent == k), None)
        bone = np.zeros(3) if below is None else old[k][1].T @ (old[below][0] - old[k][0])
        if below is not None and np.linalg.norm(bone) > 1e-9:
            sign = -1.0 if old[below][0][1] < -0.01 else 1.0
            turn, _ = Rotation.align_vectors([[sign, 0.0, 0.0]], [bone])
            node.mat = turn.as_matrix()[None]
        if node.parent >= 0:
            parent_pos, parent_mat = old[node.parent]
            offset = parent_mat.T @ (old[k][0] - parent_pos)
            node.pos = (rest[node.parent].pos[0] + rest[node.parent].mat[0] @ offset)[None]


def _nodes(body: Body, postures: np.ndarray, rig: Rig) -> list[_Node]:
    tree = body.tree
    both = [tree.forward(q) for q in postures]
    pos = {b: np.array([p[i] for p, _ in both]) for i, b in enumerate(tree.body_names)}
    mat = {b: np.array([m[i] for _, m in both]) for i, b in enumerate(tree.body_names)}
    scale = body.height_m / 1.75
    nodes: list[_Node] = []

    def add(name, parent, where, turn, is_end=False):  # type: ignore[no-untyped-def]
        nodes.append(_Node(name, parent, where, turn, is_end))
        return len(nodes) - 1

    def on(part: str, x: float, y: float, z: float) -> np.ndarray:
        return pos[part] + mat[part] @ (scale * np.array([x, y, z]))

    def named(part: str, side: str = "") -> str:
        name = NAMES[rig.names][part]
        if "{" in name:
            before, rest = name.split("{", 1)
            words, after = rest.split("}", 1)
            name = before + words.split("|")["lr".index(side)] + after
        return name

    def end(parent: int, where: np.ndarray, part: str) -> None:
        if "ends" not in rig.without:
            add("end", parent, where, mat[part], True)

    root = add(named("pelvis"), -1, pos["pelvis"], mat["pelvis"])
    top, chest_mat = _spine(rig, add, root, named, pos, mat)
    shift = nodes[top].pos + (chest_mat @ (body.tree.offset[tree.body("head")])) - pos["head"]
    if rig.spine == 2 or not rig.bends:
        shift = np.zeros_like(shift)
    neck = add(named("head"), top, pos["head"] + shift, mat["head"])
    if rig.face:
        for side, y in (("l", 0.03), ("r", -0.03)):
            eye = add(f"eye_{side}", neck, on("head", 0.08, y, 0.12) + shift, mat["head"])
            end(eye, on("head", 0.1, y, 0.12) + shift, "head")
        jaw = add("jaw", neck, on("head", 0.04, 0, 0.04) + shift, mat["head"])
        end(jaw, on("head", 0.08, 0, 0.02) + shift, "head")
    end(neck, on("head", 0.0, 0.0, 0.245) + shift, "head")
    for side in "rl" if rig.reverse else "lr":
        _arm(rig, side, add, top, named, pos, mat, on, end, shift)
    for side in "rl" if rig.reverse else "lr":
        _leg(rig, side, add, root, named, pos, mat, on, end)
    for costume in rig.costume:
        part, places = COSTUMES[costume]
        moved = shift if part == "head" else np.zeros(3)
        for sign in (1, -1) if places[-1][1] and costume != "staff" else (1,):
            base = {"pelvis": root, "chest": top, "head": neck}[part]
            for x, y, z in places:
                base = add(
                    f"{costume}{sign}_{z}", base, on(part, x, sign * y, z) + moved, mat[part]
                )
    return nodes


def _spine(rig, add, root, named, pos, mat):  # type: ignore[no-untyped-def]
    if rig.spine == 1:
        return add(named("chest"), root, pos["chest"], mat["chest"]), mat["chest"]
    if rig.spine == 2:
        low = add(named("abdomen"), root, pos["abdomen"], mat["abdomen"])
        return add(named("chest"), low, pos["chest"], mat["chest"]), mat["chest"]
    if not rig.bends:  # stiff joints between the body's own
        extra = rig.spine - 2
        low = add(named("abdomen"), root, pos["abdomen"], mat["abdomen"])
        for k in range(extra):
            share = (k + 1) / (extra + 1)
            where = (1 - share) * pos["abdomen"] + share * pos["chest"]
            low = add(f"{named('abdomen')}_{k}", low, where, mat["abdomen"])
        return add(named("chest"), low, pos["chest"], mat["chest"]), mat["chest"]
    # joints at equal distances that share out what lies between pelvis and chest
    n_frames = len(pos["pelvis"])
    mats = np.empty((rig.spine, n_frames, 3, 3))
    for t in range(n_frames):
        ends = Rotation.from_matrix([mat["pelvis"][t], mat["chest"][t]])
        shares = (np.arange(rig.spine) + 1) / rig.spine
        mats[:, t] = Slerp([0, 1], ends)(shares).as_matrix()
    low, where, turn = root, pos["pelvis"], mat["pelvis"]
    first, whole = 0.079, 0.2275
    steps = np.diff(np.concatenate(([0.0], np.linspace(first, whole, rig.spine))))
    size = np.linalg.norm(pos["abdomen"][0] - pos["pelvis"][0]) / 0.07875
    for k in range(rig.spine):
        where = where + turn @ np.array([0, 0, size * steps[k]])
        turn = mats[k]
        low = add(
            named("chest") if k == rig.spine - 1 else f"{named('abdomen')}_{k}", low, where, turn
        )
    return low, turn


def _arm(rig, side, add, top, named, pos, mat, on, end, shift):  # type: ignore[no-untyped-def]
    parent = top
    if "clavicle" not in rig.without:
        parent = add(
            named("clavicle", side), top, pos[f"clavicle_{side}"] + shift, mat[f"clavicle_{side}"]
        )
    for part, below in (("upper_arm", "forearm"), ("forearm", "hand")):
        part_side = f"{part}_{side}"
        parent = add(named(part, side), parent, pos[part_side] + shift, mat[part_side])
        if rig.helpers:
            parent = add(
                f"{named(part, side)}_zero", parent, pos[part_side] + shift, mat[part_side]
            )
        if rig.twists:
            middle = 0.5 * (pos[part_side] + pos[f"{below}_{side}"]) + shift
            parent = add(f"{named(part, side)}_twist", parent, middle, mat[part_side])
    hand, out = f"hand_{side}", 1.0 if side == "l" else -1.0
    wrist = add(named("hand", side), parent, pos[hand] + shift, mat[hand])
    if rig.prop and side == "r":
        sword = add("weapon", wrist, on(hand, 0.03, 0, -0.09) + shift, mat[hand])
        end(sword, on(hand, 1.0, 0, -0.09) + shift, hand)
    if rig.fingers:
        thumb = add(f"thumb1_{side}", wrist, on(hand, 0.03, -0.004 * out, -0.03) + shift, mat[hand])
        thumb = add(f"thumb2_{side}", thumb, on(hand, 0.05, -0.01 * out, -0.06) + shift, mat[hand])
        end(thumb, on(hand, 0.055, -0.012 * out, -0.085) + shift, hand)
        for k, x in enumerate((0.026, 0.009, -0.009, -0.026)):
            base = wrist
            places = (*((-0.03,) if rig.metacarpals else ()), -0.09, -0.125, -0.15)
            for joint, z in enumerate(places):
                where = on(hand, x, 0.0, z) + shift
                base = add(f"finger{k}{joint}_{side}", base, where, mat[hand])
            end(base, on(hand, x, 0.0, -0.18) + shift, hand)
    else:
        end(wrist, on(hand, 0.0, 0.0, -0.189) + shift, hand)


def _leg(rig, side, add, root, named, pos, mat, on, end):  # type: ignore[no-untyped-def]
    parent = root
    if rig.helpers:
        parent = add(f"{named('thigh', side)}_helper", root, pos["pelvis"], mat["pelvis"])
    for part in ("thigh", "shank"):
        parent = add(named(part, side), parent, pos[f"{part}_{side}"], mat[f"{part}_{side}"])
    foot = add(named("foot", side), parent, pos[f"foot_{side}"], mat[f"foot_{side}"])
    if "toes" in rig.without:
        end(foot, on(f"foot_{side}", 0.206, 0.0, -0.053), f"foot_{side}")
    else:
        toes = add(named("toes", side), foot, pos[f"toes_{side}"], mat[f"toes_{side}"])
        end(toes, on(f"toes_{side}", 0.08, 0.0, 0.0), f"toes_{side}")


RIGS = (
    *(replace(Rig(), names=names) for names in NAMES),
    *(replace(Rig(), zero=zero) for zero in ("hang", "A", "lying", "sitting", "odd", "bones")),
    *(replace(Rig(), order=order) for order in ("XYZ", "XZY", "YXZ", "YZX", "ZXY")),
    *(replace(Rig(), spine=n) for n in (1, 3, 5, 7)),
    *(replace(Rig(), spine=n, bends=True) for n in (3, 4, 7)),
    *(replace(Rig(), without=w) for w in (("clavicle",), ("toes",), ("ends",), ("toes", "ends"))),
    Rig(fingers=True, face=True),
    Rig(fingers=True, metacarpals=True, without=("ends",)),
    Rig(twists=True, helpers=True),
    Rig(names="numbers", zero="hang", prop=True, fingers=True),
    Rig(costume=("hair", "skirt", "tail", "staff"), names="mixamo"),
    Rig(costume=("wings",), zero="bones"),
    Rig(unit_m=1.0),
    Rig(unit_m=0.0254),
    Rig(up="z", yaw=0.7),
    Rig(yaw=2.5, reverse=True),
    Rig(names="german", zero="A", order="YXZ", spine=5, bends=True, fingers=True, reverse=True),
)
