"""Momenta and zero-moment points against MuJoCo."""

import mujoco
import numpy as np
from planners import humanoid_reference

from mplearn_envs.mechanics.momentum import ground_reaction, momenta
from mplearn_envs.mechanics.support import zero_moment_point
from mplearn_envs.robot import humanoid

HUMANOID = humanoid()


def test_momenta_are_mujocos():
    rng = np.random.default_rng(3)
    model = HUMANOID.model()
    data = mujoco.MjData(model)
    q, v = rng.normal(scale=0.5, size=(5, model.nq)), rng.normal(size=(5, model.nv))
    q[:, 3:7] /= np.linalg.norm(q[:, 3:7], axis=1)[:, None]
    feet = humanoid_reference().stance.feet
    cog, linear, angular, soles = momenta(
        humanoid_reference().tree,
        humanoid_reference().inertia,
        feet,
        humanoid_reference().corners,
        q,
        v,
    )
    for t in range(len(q)):
        data.qpos[:], data.qvel[:] = q[t], v[t]
        mujoco.mj_forward(model, data)
        mujoco.mj_subtreeVel(model, data)
        np.testing.assert_allclose(cog[t], data.subtree_com[1], atol=1e-12)
        np.testing.assert_allclose(
            linear[t], data.subtree_linvel[1] * model.body_subtreemass[1], atol=1e-10
        )
        np.testing.assert_allclose(angular[t], data.subtree_angmom[1], atol=1e-10)
        for side, foot in enumerate(feet):
            turn, place = data.xmat[foot + 1].reshape(3, 3), data.xpos[foot + 1]
            expected = humanoid_reference().corners[side] @ turn.T + place
            np.testing.assert_allclose(soles[t, side], expected, atol=1e-10)


def test_the_grounds_reaction_is_what_the_contacts_carry():
    """A robot that sways: the zero-moment point from the momentum is the contacts'."""
    model = HUMANOID.model()
    data = mujoco.MjData(model)
    data.qpos[:] = humanoid_reference().rest
    sway = HUMANOID.joint_names.index("waist_yaw")
    names = [HUMANOID.joint_names.index(f"shoulder_pitch_{side}") for side in "lr"]
    q, v, expected = [], [], []
    for step in range(200):
        data.ctrl[:] = humanoid_reference().rest[7:]
        data.ctrl[sway] = 0.3 * np.sin(0.02 * step)
        data.ctrl[names] = 0.4 * np.sin(0.02 * step)
        q.append(data.qpos.copy())
        v.append(data.qvel.copy())
        mujoco.mj_step(model, data)
        total, weighted = 0.0, np.zeros(2)
        wrench = np.zeros(6)
        for i, contact in enumerate(data.contact):
            mujoco.mj_contactForce(model, data, i, wrench)
            lift = (contact.frame.reshape(3, 3).T @ wrench[:3])[2]
            total += lift
            weighted += lift * contact.pos[:2]
        expected.append(weighted / max(total, 1.0))
    points = humanoid_reference().stance.feet[:0], humanoid_reference().corners[:0]
    dynamics = momenta(
        humanoid_reference().tree, humanoid_reference().inertia, *points, np.array(q), np.array(v)
    )
    zmp = ground_reaction(
        float(humanoid_reference().tree.mass.sum()), *dynamics[:3], model.opt.timestep
    )
    np.testing.assert_allclose(zmp[20:], np.array(expected)[20:-1], atol=0.004)
    assert np.ptp(np.array(expected)[20:, 0]) > 0.01


def test_nothing_carries_in_free_fall():
    assert np.isnan(zero_moment_point(np.zeros(3), np.zeros(3), np.zeros(3))).all()
