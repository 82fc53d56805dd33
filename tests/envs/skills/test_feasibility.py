"""Verdicts and their reasons."""

from functools import cache

import numpy as np
import pytest
from planners import planner
from standing_library import (
    ARMS,
    BOW,
    KICK,
    RATE_HZ,
    SQUAT,
    STANDING_M,
    posture,
    standing_library,
    sweep,
)

from mplearn.errors import InvalidValueError
from mplearn_envs.environment.options import MotionOptions
from mplearn_envs.mechanics.reference import rest_reference, tracked_columns
from mplearn_envs.planning import Motion, Planner
from mplearn_envs.robot import humanoid
from mplearn_envs.skills.feasibility import FeasibilityCheck, FeasibilityConfig, Problem
from mplearn_envs.skills.repertoire import Repertoire
from mplearn_envs.skills.skills import Skills


@cache
def check():
    return FeasibilityCheck(planner())


def judged(check, frames, rate_hz, speed):
    return check.judge(check.planner.motion(frames, rate_hz), speed)


def kinds(verdict):
    return [problem.kind for problem in verdict.problems]


@pytest.mark.parametrize("end", [ARMS, BOW, SQUAT])
@pytest.mark.parametrize("speed", [0.5, 1.0])
def test_motions_with_both_feet_down_are_feasible(end, speed):
    verdict = judged(check(), sweep({}, end, 1.0), RATE_HZ, speed)
    assert verdict.feasible and verdict.speed == speed
    assert verdict.zmp_margin_m > 0.05 and 0.05 < verdict.torque_share < 0.6


@pytest.mark.parametrize("side", ["l", "r"])
@pytest.mark.parametrize("speed", [0.5, 1.0])
def test_lifting_a_foot_is_feasible_and_says_which(side, speed):
    lift = {name.replace("_l", f"_{side}"): value for name, value in KICK.items()}
    which = "lr".index(side)
    for frames, feet in ((sweep({}, lift, 0.8), (-1, which)), (sweep(lift, {}, 0.8), (which, -1))):
        verdict = judged(check(), frames, RATE_HZ, speed)
        assert verdict.feasible, verdict.problems
        assert (verdict.starts_up, verdict.ends_up) == feet
        assert 0.3 < verdict.tempo <= speed + 0.01


def test_a_jump_is_refused_with_that_reason():
    up = sweep({}, {"base_height": 0.2}, 0.3)
    verdict = judged(check(), np.vstack((up, up[::-1])), RATE_HZ, 0.5)
    assert kinds(verdict) == ["flight"]
    assert verdict.problems[0].value == pytest.approx(0.2, abs=0.01)
    assert "allowed 0.06" in str(verdict.problems[0])


def test_small_differences_of_the_feet_are_no_lift():
    shuffle = {"knee_l": 0.15, "hip_pitch_l": -0.08, "ankle_pitch_l": -0.07}
    assert judged(check(), sweep({}, shuffle, 1.0), RATE_HZ, 0.5).feasible


def test_too_fast_a_motion_is_slowed_down_and_at_last_refused():
    fast = sweep({}, ARMS, 0.12)
    slowed = judged(check(), fast, RATE_HZ, 1.0)
    assert slowed.speed < 1.0
    frantic = judged(
        check(), np.vstack([sweep({}, ARMS, 0.05), sweep(ARMS, {}, 0.05)] * 3), RATE_HZ, 2.0
    )
    assert not frantic.feasible and {"velocity", "torque", "balance"} & set(kinds(frantic))


def test_what_is_beyond_the_joints_is_refused():
    verdict = judged(check(), sweep({}, {"elbow_l": 1.0}, 1.0), RATE_HZ, 0.5)
    assert kinds(verdict) == ["limit"]
    assert verdict.problems[0].where == "elbow_l"


def test_a_squat_too_deep_for_the_legs_is_out_of_reach():
    """With the trunk upright, that is; leaning ahead the robot reaches it."""
    deep = sweep({}, {"base_height": -0.47}, 2.0)
    upright = Motion(np.ascontiguousarray(deep[:, tracked_columns(humanoid())]), RATE_HZ)
    assert judged(check(), deep, RATE_HZ, 0.5).feasible
    verdict = check().judge(upright, 0.5)
    assert not verdict.feasible and "reach" in kinds(verdict)
    where = next(each.where for each in verdict.problems if each.kind == "reach")
    assert where.startswith("ankle_pitch_l, ankle_pitch_r")


def test_torque_and_balance_limits_are_kept():
    motion = sweep({}, BOW, 1.0)
    weak = FeasibilityCheck(check().planner, FeasibilityConfig(torque_share=0.05))
    assert "torque" in kinds(judged(weak, motion, RATE_HZ, 0.5))
    timid = FeasibilityCheck(check().planner, FeasibilityConfig(zmp_margin_m=0.2))
    assert "balance" in kinds(judged(timid, motion, RATE_HZ, 0.5))


@pytest.mark.parametrize(
    "wrong",
    [
        {"transitions": "no"},
        {"transitions": 1},
        {"flight_m": "x"},
        {"torque_share": -0.1},
        {"reach_error": np.nan},
        {"slowest": True},
        {"slowest": 0.0},
    ],
)
def test_limits_that_are_none_are_refused(wrong):
    with pytest.raises(InvalidValueError, match=next(iter(wrong))):
        FeasibilityConfig(**wrong)
    with pytest.raises(InvalidValueError, match=next(iter(wrong))):
        MotionOptions(feasibility=wrong)


def test_a_jerky_motion_is_slowed_for_balance():
    """A bow whose full speed would throw the zero-moment point out of the soles."""
    careful = FeasibilityCheck(check().planner, FeasibilityConfig(zmp_margin_m=0.09))
    verdict = judged(careful, sweep({}, {"base_pitch": 0.9}, 0.7), RATE_HZ, 1.0)
    assert verdict.speed < 1.0
    assert verdict.feasible and verdict.zmp_margin_m > 0.09


def test_standing_postures_are_reached():
    motion = check().planner.motion(np.stack([posture({})] * 2), RATE_HZ)
    assert motion.frames[0, 0] == STANDING_M
    reference = check().way_in(motion).end
    np.testing.assert_allclose(reference.target, motion.frames[0], atol=1e-6)
    assert np.abs(reference.velocity).max() < 1e-6


def test_transitions_are_judged_where_that_is_wanted(monkeypatch):
    """A real plan from the end of one to the end of the other; what cannot follow is masked."""
    library, robot = standing_library(("arms up", "arms down", "bow down", "bow up")), humanoid()
    skills = Skills(library, robot)
    pairs = [(a, b) for a in library.ids for b in library.ids]
    assert not any(skills.follows(a, b) for a, b in pairs)
    assert check().judge_plan(skills.plan(skills.end(pairs[1][0]), pairs[1][1])) == ()
    up, down = (library[name].id for name in ("arms up", "arms down"))
    plan = skills.plan(skills.end(up), down)
    off = plan._replace(error=plan.error + 0.1, zmp_margin_m=plan.zmp_margin_m - 0.2)
    assert [each.kind for each in check().judge_plan(off)] == ["reach", "balance"]

    after = Repertoire(library, robot).after(down)
    asked = []

    def refuse(self, before, after):
        asked.append((before, after))
        return (Problem("balance", "the soles", -0.01, 0.0),)

    monkeypatch.setattr(Skills, "follows", refuse)
    same = Repertoire(library, robot).after(down)
    np.testing.assert_array_equal(same.mask, after.mask)
    assert not asked
    judged_too = Repertoire(library, robot, limits=FeasibilityConfig(transitions=True)).after(down)
    assert asked and all(before == down for before, _ in asked)
    assert after.mask.sum() - judged_too.mask.sum() == len(asked) > 0


def test_a_verdict_plans_the_way_in_once(monkeypatch):
    library, robot = standing_library(("arms up", "arms down", "bow down")), humanoid()
    planned = []
    plan = Planner.plan
    monkeypatch.setattr(Planner, "plan", lambda *a: planned.append(a) or plan(*a))
    skills = Skills(library, robot)
    assert all(skills.feasibility(id).feasible for id in library.ids)
    ways_in = [a for a in planned if len(a[2].frames) == 2 and a[2].rate_hz == 1.0]
    assert len(ways_in) == len(library)
    for id in library.ids:
        skills.end(id)
        assert skills._check.way_in(skills[id].motion, skills.key(id)).end.lifted == -1
    assert len([a for a in planned if len(a[2].frames) == 2]) == len(library)


def test_what_can_be_done_nowhere_is_an_error_of_ours():
    """Not a mask that allows what cannot be planned, nor an error of who multiplies arrays."""
    repertoire = Repertoire(standing_library(("arms up", "arms down")), humanoid())
    here = rest_reference(humanoid())
    anything = repertoire.entries(here)
    lost = here._replace(q=np.full_like(here.q, np.nan))
    assert not repertoire.skills.leads_home(lost)
    with pytest.raises(InvalidValueError, match="must be finite; q is not"):
        repertoire.from_place(anything, lost)
