"""The experiments with the robot: what they vary, what they count."""

import numpy as np
from standing_library import standing_library

from mplearn_envs.execution.reflexes import _TUNED
from mplearn_envs.execution.simulation import Simulation
from mplearn_envs.experiments import (
    learned_table,
    push_table,
    random_walks,
    speed_table,
    walk_table,
)
from mplearn_envs.experiments.model_error import disturb
from mplearn_envs.experiments.survival import pushed
from mplearn_envs.mechanics import rest_reference
from mplearn_envs.robot import humanoid
from mplearn_envs.skills.skills import Skills


def test_random_walks_count_what_happened():
    library = standing_library()
    walks = random_walks(library, seeds=(1,), n_primitives=5, speeds=(1.0,))
    assert [walk.lifting for walk in walks] == [False, True]
    assert all(len(walk.steps) == 5 and not walk.fell for walk in walks)
    assert not {"kick", "retract"} & {step[0] for step in walks[0].steps}
    again = random_walks(library, seeds=(1,), n_primitives=5, speeds=(1.0,))
    assert [walk.steps for walk in again] == [walk.steps for walk in walks]
    table = walk_table(walks)
    assert [row[4] for row in table.rows] == ["0", "0"]
    performed = speed_table(library, speeds=(0.5,)).rows[0][1:4]
    assert sum(float(cell.split()[0]) for cell in performed) > 99.0


def test_any_primitive_may_follow_any_other():
    (row,) = learned_table([("me", standing_library())], seeds=(1, 2), n_primitives=4).rows
    assert row[0] == "me" and row[3] == "2 x 4" and row[4] == "0"
    feasible, learned = (int(number) for number in row[1].split(" of "))
    assert feasible == learned - 1 and row[6].startswith("jump: flight")
    assert 0 < int(row[2]) < feasible


def test_what_the_verdict_on_its_plan_refuses_is_not_performed(monkeypatch):
    """The robot goes by way of rest: it performs plans that pass, and they are counted."""
    performed = []
    perform = Simulation.perform
    monkeypatch.setattr(Skills, "judge_plan", lambda self, plan: ("no",))
    monkeypatch.setattr(
        Simulation, "perform", lambda self, plan: (performed.append(plan), perform(self, plan))[1]
    )
    (row,) = learned_table([("me", standing_library())], seeds=(1,), n_primitives=4).rows
    assert row[3] == "1 x 4" and row[4] == "0" and row[7] == "4 of 4"
    rest = rest_reference(humanoid()).q[7:]
    for plan in performed:
        assert plan.error.max() < 0.01 and plan.zmp_margin_m.min() > 0.0075
        still = np.abs(plan.q[:, 7:] - rest).max(axis=1) < 1e-3
        assert still[1:-1].any()


def test_the_model_error_is_what_was_asked_for():
    exact, wrong = Simulation(humanoid()).model, Simulation(humanoid()).model
    disturb(wrong, 0.1, np.random.default_rng(0))
    for name in ("body_mass", "actuator_gainprm", "geom_friction"):
        before, after = getattr(exact, name), getattr(wrong, name)
        share = after[before > 0] / before[before > 0] - 1.0
        assert 0.0 < np.abs(share).max() <= 0.1
    assert wrong.actuator_biasprm[0, 1] == -wrong.actuator_gainprm[0, 0]


def test_who_learns_how_wrong_his_servos_are_survives_more_pushes(monkeypatch):
    """Of 24 pushes amid primitives, masses, gains and friction wrong by 10 %."""
    library, survived = standing_library(), []
    for learns in (0.0, _TUNED["learns"]):
        monkeypatch.setitem(_TUNED, "learns", learns)
        survived.append(sum(each.survived for each in pushed(library, 36.0, 3, error=0.1)))
    assert survived[1] >= survived[0] + 4


def test_pushes_are_survived_up_to_a_limit():
    (row, _) = push_table(feedback=("never",), resolution_ns=8.0).rows
    impulses = [float(cell) for cell in row[2:]]
    assert all(5.0 < impulse < 60.0 for impulse in impulses)
    assert abs(impulses[2] - impulses[3]) < 1e-9  # left and right
    for row in push_table(feedback=("always",), resolution_ns=20.0).rows:  # amid a squat, too
        assert all(5.0 < float(cell) < 60.0 for cell in row[2:])
