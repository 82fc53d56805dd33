"""The built-in library: `gym.make` without an argument."""

import gymnasium
import numpy as np

import mplearn_envs  # noqa: F401  (registers the environment)
from mplearn_envs.data.build import PATH, build_default


def test_the_committed_library_is_what_the_command_makes():
    """Up to the last digits, which differ from processor to processor."""
    committed = gymnasium.make("mplearn/PrimitiveHumanoid-v0").unwrapped.library
    built = build_default()
    assert PATH.stat().st_size < 400_000
    assert built.names == committed.names and built.channels == committed.channels
    assert built.graph.ids == committed.graph.ids
    for id in built.ids:
        np.testing.assert_allclose(built.graph.prior(id), committed.graph.prior(id))
        np.testing.assert_allclose(built[id].hmm.means, committed[id].hmm.means, atol=1e-3)


def test_forty_random_primitives_without_a_fall():
    env = gymnasium.make("mplearn/PrimitiveHumanoid-v0")
    _, info = env.reset(seed=0)
    env.action_space.seed(0)
    performed = set()
    for _ in range(40):
        action = env.action_space.sample(probability=info["transition_prior"])
        _, reward, terminated, _, info = env.step(action)
        assert not terminated and not info["illegal"] and reward > 0
        assert info["cog_deviation_m"] < 0.02
        assert np.rad2deg(info["tracking_rmse_rad"]) < 1.0
        performed.add(info["primitive_name"])
    assert len(performed) >= 8


def test_the_robot_can_perform_all_of_it_feet_lifted_too():
    env = gymnasium.make("mplearn/PrimitiveHumanoid-v0").unwrapped
    repertoire = env.repertoire
    assert repertoire.feasible_ids == repertoire.ids
    raised = [id for id in repertoire.ids if repertoire.skills.feasibility(id).ends_up >= 0]
    names = {env.library[id].name for id in raised}
    assert any("kick" in name for name in names) and any("march" in name for name in names)
