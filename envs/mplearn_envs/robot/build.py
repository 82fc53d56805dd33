"""Build the robots' simulation models: ``python -m mplearn_envs.robot.build``.

It writes ``models/*.xml``, which is committed and loaded as text: only here dm_control is needed.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from .drives import HUMANOID_DRIVES

TIMESTEP_S = 0.004


def build_humanoid() -> str:
    """Return the humanoid's simulation model as MJCF text: body, servos, floor, lights, cameras."""
    from mplearn.body.models.robot import HELD, build_robot

    root = build_robot()
    root.model = "humanoid"
    for name in HELD:
        root.find("joint", name).remove()
    _add_surroundings(root)
    _add_servos(root)
    text = str(root.to_xml_string(precision=7))
    # dm_control's schema does not know this integrator of MuJoCo yet
    return text.replace("<option ", '<option integrator="discrete" ', 1)


def _add_surroundings(root: Any) -> None:
    root.option.timestep = TIMESTEP_S
    root.option.cone = "elliptic"
    root.option.impratio = 10
    visual = getattr(root.visual, "global")
    visual.offwidth, visual.offheight = 1920, 1080
    root.visual.headlight.ambient = [0.35, 0.35, 0.38]
    root.visual.headlight.diffuse = [0.35, 0.35, 0.35]
    root.visual.quality.shadowsize = 2048
    root.visual.map.znear = 0.05
    root.asset.add(
        "texture",
        type="skybox",
        builtin="gradient",
        rgb1=[0.78, 0.85, 0.93],
        rgb2=[0.96, 0.97, 0.98],
        width=64,
        height=384,
    )
    root.asset.add(
        "texture",
        name="tiles",
        type="2d",
        builtin="checker",
        mark="edge",
        width=300,
        height=300,
        rgb1=[0.86, 0.87, 0.88],
        rgb2=[0.82, 0.83, 0.85],
        markrgb=[0.74, 0.75, 0.77],
    )
    root.asset.add(
        "material",
        name="floor",
        texture="tiles",
        texrepeat=[1, 1],
        texuniform=True,
        reflectance=0.08,
    )
    root.worldbody.add(
        "geom",
        name="floor",
        type="plane",
        size=[0, 0, 1],
        material="floor",
        contype=1,
        conaffinity=1,
        condim=3,
        friction=[1.0, 0.005, 0.0001],
        group=0,
    )
    root.worldbody.add(
        "light",
        name="sun",
        pos=[1.5, 1.5, 4.0],
        dir=[-0.35, -0.3, -0.9],
        directional=True,
        diffuse=[0.55, 0.54, 0.52],
        specular=[0.3, 0.3, 0.3],
        castshadow=True,
    )
    root.worldbody.add(
        "camera",
        name="front",
        pos=[3.0, 1.1, 1.25],
        xyaxes=[-0.345, 0.939, 0, -0.12, -0.044, 0.992],
        fovy=42,
    )


def _add_servos(root: Any) -> None:
    drives = {name: group for group in HUMANOID_DRIVES for name in group.names}
    for joint in root.find_all("joint"):
        if joint.tag == "freejoint":
            continue
        drive = drives[joint.name]
        root.actuator.add(
            "position",
            name=joint.name,
            joint=joint.name,
            kp=drive.stiffness,
            kv=drive.damping,
            forcerange=[-drive.torque, drive.torque],
        )


def main() -> None:
    """Write every model into the package."""
    folder = Path(__file__).parent / "models"
    folder.mkdir(exist_ok=True)
    (folder / "humanoid.xml").write_text(build_humanoid(), encoding="utf-8")


if __name__ == "__main__":
    main()
