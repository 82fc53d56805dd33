"""Training: interrupted or not, trained further, grown; and what it says to bad input."""

from dataclasses import replace

import numpy as np
import pytest
from standing_library import standing_library

from mplearn.errors import InvalidValueError
from mplearn.hmm import fit
from mplearn.library import Primitive, PrimitiveLibrary
from mplearn_agents.cli import main
from mplearn_agents.rl import ProjectIllegal, TrainedPolicy, TrainingConfig
from mplearn_agents.rl.config import VERSION
from mplearn_agents.rl.growing import grow
from mplearn_agents.rl.projection import project
from mplearn_agents.rl.train import make_environment, train
from mplearn_envs.varied.changes import CHANGES
from mplearn_envs.varied.people import SPLITS

pytest.importorskip("sb3_contrib")
torch = pytest.importorskip("torch")
pytest.importorskip("tensorboard")

SMALL = ("arms up", "arms down", "bow down", "bow up")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with two libraries: one learned for a while, and the same a while later."""
    path = tmp_path_factory.mktemp("training")
    standing_library(SMALL).save(path / "small.mplearn")
    standing_library().save(path / "grown.mplearn")
    return path


@pytest.fixture(scope="module")
def config(folder):
    return TrainingConfig(
        task="goal", library=str(folder / "small.mplearn"), steps=4096, round_steps=2048, episodes=4
    )


@pytest.fixture(scope="module")
def agent(folder, config):
    return train(config, folder / "whole")


def weights(agent):
    return {name: value.numpy() for name, value in agent.model.policy.state_dict().items()}


def test_a_training_that_was_interrupted_ends_like_one_that_was_not(folder, config, agent):
    train(replace(config, steps=2048), folder / "halves")
    resumed = train(config, folder / "halves", resume=True)
    for name, value in weights(agent).items():
        np.testing.assert_array_equal(weights(resumed)[name], value, err_msg=name)
    whole, halves = ((folder / name / "evaluation.csv").read_text() for name in ("whole", "halves"))
    assert whole == halves
    assert len(whole.splitlines()) == 3
    assert list((folder / "whole" / "log").rglob("events.out.tfevents*"))


def test_an_agent_is_loaded_as_it_was_left(folder, agent):
    loaded = TrainedPolicy.load(folder / "whole")
    for name, value in weights(agent).items():
        np.testing.assert_array_equal(weights(loaded)[name], value)
    assert loaded.config == agent.config
    assert loaded.slots == agent.slots == {3: 1, 4: 2, 5: 3, 6: 4}


def test_an_agent_is_refused_on_another_library_of_the_same_ids(folder, config):
    """Ids and slots agree, and what they stand for does not."""
    library = PrimitiveLibrary.load(config.library)
    others = library.primitives[2:] + library.primitives[:2]
    swapped = tuple(
        replace(other, id=own.id, name=own.name)
        for own, other in zip(library.primitives, others, strict=True)
    )
    agent = TrainedPolicy.load(folder / "whole")
    agent.require_fit(make_environment(config))
    path = replace(library, primitives=swapped).save(folder / "swapped.mplearn")
    env = make_environment(replace(config, library=str(path)))
    with pytest.raises(InvalidValueError, match=r"another library: the primitives \[3, 4, 5, 6\]"):
        agent.require_fit(env)


def test_an_agent_is_refused_where_motions_differ_between_equal_ends(folder, config):
    library = PrimitiveLibrary.load(config.library)
    first, *others = library.primitives
    elbow = np.array([name == "elbow_l" for name in library.channels])
    assert elbow.any()
    arches = [1.2 * np.sin(np.linspace(0, np.pi, len(each)))[:, None] for each in first.exemplars]
    motions = [each - elbow * arch for each, arch in zip(first.exemplars, arches, strict=True)]
    hmm = fit(motions, 10, variance_floor=1e-4)
    bent = Primitive.from_exemplars(first.id, hmm, motions, first.rate_hz, name=first.name)
    path = replace(library, primitives=(bent, *others)).save(folder / "bent.mplearn")
    agent = TrainedPolicy.load(folder / "whole")
    env = make_environment(replace(config, library=str(path)))
    with pytest.raises(InvalidValueError, match=rf"another library: the primitives \[{first.id}\]"):
        agent.require_fit(env)


def test_no_agent_ever_takes_an_illegal_action(folder, config):
    """In 10,000 steps, drawing, from a vector environment with sb3-contrib's own masks."""
    from sb3_contrib.common.maskable.utils import get_action_masks
    from stable_baselines3.common.vec_env import DummyVecEnv

    agent = TrainedPolicy.load(folder / "whole", deterministic=False)
    envs = DummyVecEnv([lambda: make_environment(config)] * 50)
    envs.seed(3)
    observations, illegal = envs.reset(), 0
    for _ in range(200):
        masks = get_action_masks(envs)
        actions, _ = agent.model.predict(observations, action_masks=masks)
        assert masks[np.arange(50), actions].all()
        observations, _, _, infos = envs.step(actions)
        illegal += sum(info["illegal"] for info in infos)
    envs.close()
    assert illegal == 0


def test_projection_keeps_legal_actions_and_shares_the_others_evenly(config):
    mask = np.array([1, 0, 0, 1, 1, 0, 0, 0, 0])
    assert [project(a, mask) for a in (0, 3, 4)] == [0, 3, 4]
    assert sorted(project(a, mask) for a in (1, 2, 5, 6, 7, 8)) == [0, 0, 3, 3, 4, 4]
    env = ProjectIllegal(make_environment(config))
    env.reset(seed=0)
    for action in range(env.action_space.n):
        legal = env.get_wrapper_attr("action_masks")()
        _, _, ended, _, info = env.step(action)
        assert legal[info["action"]]
        assert not info["illegal"]
        if ended:
            env.reset()
    env.close()


@pytest.mark.parametrize("prior", ["feature", "logits", "regulariser"])
def test_what_the_prior_is_to_an_untrained_agent(config, prior):
    from stable_baselines3.common.vec_env import DummyVecEnv

    from mplearn_agents.rl.algorithms import new_model

    env = make_environment(config)
    model = new_model(replace(config, prior=prior), DummyVecEnv([lambda: env]), {})
    observation, info = env.reset(seed=1)
    for _ in range(4):
        policy = model.policy
        seen = policy.obs_to_tensor({key: np.asarray(x) for key, x in observation.items()})[0]
        mask = info["action_mask"].astype(bool)
        with torch.no_grad():
            probs = policy.get_distribution(seen, mask).distribution.probs[0].numpy()
            action = torch.tensor([int(np.argmax(mask))])
            bonus = policy.evaluate_actions(seen, action, action_masks=mask)[2].item()
        assert (probs[~mask] == 0).all()
        likely = np.maximum(info["transition_prior"], 0.01) * mask
        waiting = np.where(np.arange(len(mask)) == 0, 0.5, 0.5 / (mask.sum() - 1)) * mask
        wanted = {"logits": likely / likely.sum(), "feature": waiting}.get(prior, mask / mask.sum())
        np.testing.assert_allclose(probs, wanted, atol=0.05)
        p = probs[mask]
        entropy = -(p * np.log(p)).sum()
        log_prior = np.log(np.maximum(info["transition_prior"], 0.01) / 0.01)[mask]
        expected = entropy + (p * log_prior).sum() if prior == "regulariser" else entropy
        assert bonus == pytest.approx(expected, abs=1e-5)
        observation, _, ended, _, info = env.step(int(np.argmax(info["transition_prior"])))
        if ended:
            observation, info = env.reset()
    env.close()


def test_an_agent_chooses_the_speed_with_the_primitive(folder, config):
    """Untrained, at any speed as the prior says; in a while it has found out that fast is good."""
    from stable_baselines3.common.vec_env import DummyVecEnv

    from mplearn_agents.rl.algorithms import new_model

    usual = make_environment(config)
    capacity = int(usual.action_space.n)
    usual.close()
    fast = replace(config, speeds=(0.5, 1.0), n_envs=4, round_steps=1024, steps=4096)
    env = make_environment(fast)
    assert env.action_space.n == 2 * capacity
    untrained = new_model(fast, DummyVecEnv([lambda: env]), {}).policy
    observation, info = env.reset(seed=1)
    seen = untrained.obs_to_tensor({key: np.asarray(x) for key, x in observation.items()})[0]
    with torch.no_grad():
        given = untrained.get_distribution(seen, info["action_mask"].astype(bool))
        slow, quick = given.distribution.probs[0].numpy().reshape(2, capacity)
    np.testing.assert_allclose(slow, quick, atol=0.02)
    mask, prior = (info[key][:capacity] for key in ("action_mask", "transition_prior"))
    likely = np.maximum(prior, 0.01) * mask
    np.testing.assert_allclose(slow + quick, likely / likely.sum(), atol=0.05)
    agent = train(fast, folder / "speeds")
    again = TrainedPolicy.load(folder / "speeds")
    again.require_fit(env)
    quickly = []
    for seed in range(8):
        observation, info = env.reset(seed=seed)
        for _ in range(20):
            action = agent.act(observation, info)
            assert action == again.act(observation, info)
            if action % capacity:
                quickly.append(action >= capacity)
            observation, _, ended, _, info = env.step(action)
            if ended:
                break
    env.close()
    assert np.mean(quickly) > 0.8
    with pytest.raises(InvalidValueError, match="speeds must be one or more"):
        replace(config, speeds=())


def test_a_training_says_all_of_its_environment():
    given = {"body": "harsh", "actions": {"illegal": "raise"}}
    config = TrainingConfig(task="goal", speeds=(1.0, 0.5), discount=0.9, environment=given)
    assert config.options == {
        "task": "goal",
        "dynamics": "kinematic",
        "discount": 0.9,
        "body": "harsh",
        "actions": {"illegal": "raise", "speeds": (1.0, 0.5)},
    }
    assert given["actions"] == {"illegal": "raise"}


def embedded(observation, env, slots):
    """Return an observation as an environment with more slots would show it."""
    out = {key: np.asarray(value) for key, value in observation.items()}
    for key in ("action_mask", "transition_prior"):
        wide = np.zeros(env.action_space.n, out[key].dtype)
        wide[[0, *slots.values()]] = out[key][[0, *slots]]
        out[key] = wide
    current = int(out["current_primitive"])
    out["current_primitive"] = np.int64(slots[current] if current else 0)
    return out


def test_an_agent_of_speeds_grows_with_them(folder, config):
    speeds = replace(config, speeds=(1.0, 0.5), n_envs=2, steps=256, round_steps=256)
    agent = train(speeds, folder / "growing speeds")
    more = make_environment(replace(speeds, library=str(folder / "grown.mplearn")))
    grow(agent, more).require_fit(more)
    less = make_environment(replace(config, library=str(folder / "grown.mplearn")))
    with pytest.raises(InvalidValueError, match="chooses among 2 speeds, here it would among 1"):
        grow(agent, less)


@pytest.mark.parametrize("task", ["goal", "recite"])
def test_a_grown_agent_does_what_it_did(folder, config, agent, task):
    """With a larger capacity, and old primitives in other slots (as if they had been there)."""
    from mplearn_agents.rl.growing import grow

    start = agent
    if task != "goal":  # an untrained one will do
        start = train(replace(config, task=task, steps=1, round_steps=1), folder / task)
    larger = replace(
        start.config,
        library=str(folder / "grown.mplearn"),
        environment={"actions": {"capacity": 40}},
    )
    small, large = make_environment(start.config), make_environment(larger)
    reversed_slots = dict(zip(start.slots, reversed(start.slots.values()), strict=True))
    start = TrainedPolicy(start.model, start.config, reversed_slots)
    grown = grow(start, large)
    moved = {slot: grown.slots[id] for id, slot in reversed_slots.items()}
    observation, info = small.reset(seed=5)
    for _ in range(6):
        wide = embedded(observation, large, moved)
        if task == "recite":
            n, m = small.action_space.n, large.action_space.n
            task_part = np.zeros(3 * m + 1)
            task_part[-1] = observation["task"][-1]
            for k in range(3):
                for old, new in moved.items():
                    task_part[k * m + new] = observation["task"][k * n + old]
            wide["task"] = task_part
        out = []
        for each, seen in ((start, observation), (grown, wide)):
            policy = each.model.policy
            tensors = policy.obs_to_tensor({key: np.asarray(x) for key, x in seen.items()})[0]
            with torch.no_grad():
                mask = np.asarray(seen["action_mask"], bool)
                probs = policy.get_distribution(tensors, mask).distribution.probs[0].numpy()
                out.append((probs, policy.predict_values(tensors).item()))
        (before, value_before), (after, value_after) = out
        assert value_after == pytest.approx(value_before, abs=1e-5)
        np.testing.assert_allclose(after[list(moved.values())], before[list(moved)], atol=1e-6)
        action = start.act(observation, info)
        assert moved.get(action, 0) == grown.act(wide, {"action_mask": wide["action_mask"]})
        observation, _, ended, _, info = small.step(action)
        if ended:
            observation, info = small.reset()
    small.close()
    large.close()


def test_a_grown_agent_is_trained_further(folder, config, agent):
    from mplearn_agents.rl.growing import grow

    larger = replace(config, library=str(folder / "grown.mplearn"), steps=1, round_steps=1)
    env = make_environment(larger)
    with pytest.raises(InvalidValueError, match=r"primitives \[7, 8, "):
        agent.require_fit(env)
    grown = grow(agent, env)
    grown.require_fit(env)
    further = train(larger, folder / "further", start=grown)
    change = weights(further)["action_net.weight"] - weights(grown)["action_net.weight"]
    assert 0 < np.abs(change).max() < 0.1
    env.close()


def test_bad_input_is_said(folder, config, agent, capsys, tmp_path):
    with pytest.raises(InvalidValueError, match="algorithm must be one of"):
        TrainingConfig(algorithm="sarsa")
    with pytest.raises(InvalidValueError, match="steps must be at least 1, not 0"):
        TrainingConfig(steps=0)
    with pytest.raises(InvalidValueError, match="holds a training: resume it"):
        train(config, folder / "whole")
    with pytest.raises(InvalidValueError, match="holds another training"):
        train(replace(config, seed=9), folder / "whole", resume=True)
    with pytest.raises(InvalidValueError, match="no training to resume"):
        train(config, tmp_path / "none", resume=True)
    with pytest.raises(InvalidValueError, match="holds no training"):
        TrainedPolicy.load(tmp_path)
    (tmp_path / "training.json").write_text(f'{{"version": {VERSION}, "slots": 3}}')
    with pytest.raises(InvalidValueError, match="missing or damaged"):
        TrainedPolicy.load(tmp_path)
    (tmp_path / "training.json").write_text('{"task": "goal", "slots": {}}')
    with pytest.raises(InvalidValueError, match="agent of version 1; here are agents of version"):
        TrainedPolicy.load(tmp_path)
    env = make_environment(replace(config, task="recite"))
    with pytest.raises(InvalidValueError, match="another task"):
        agent.require_fit(env)
    env.close()
    for options, said in (
        (["--task", "fly"], "task must be a Task or one of"),
        (["--changes", "all", "--people", "test"], "--people and --changes: only of v1"),
        (["--changes", "all", "--env", "v1"], "choose the task 'follow'"),
    ):
        assert main(["train", "--out", str(folder / "x"), *options]) == 2
        assert said in capsys.readouterr().err


OWN_TASK = """
from __future__ import annotations
from dataclasses import dataclass
import numpy as np
from mplearn_envs.tasks import Task

@dataclass
class Waving(Task):
    worth: float = 0.5
    def bonuses(self, choice):
        return {"waved": self.worth * (choice.primitive is not None)}
    def rates(self, report):
        return {}
    @property
    def done(self):
        return False

class Nothing:
    pass
"""


def test_a_training_takes_settings_and_a_task_of_ones_own(folder, capsys, tmp_path):
    own = tmp_path / "waving.py"
    own.write_text(OWN_TASK, "utf-8")
    task, library = f"{own}:Waving", str(folder / "small.mplearn")
    out = ["--library", library, "--steps", "1", "--round-steps", "1", "--episodes", "1"]
    settings = ["--learning-rate", "0.002", "--network", "16", "8", "--envs", "2"]
    where = ["--out", str(tmp_path / "agent"), "--task", task, "--discount", "0.8"]
    assert main(["train", *out, *settings, *where]) == 0
    agent = TrainedPolicy.load(tmp_path / "agent")
    assert agent.config.task == task and agent.config.network == (16, 8)
    assert agent.model.learning_rate == 0.002 and agent.model.n_envs == 2
    layers = agent.model.policy.mlp_extractor.mlp.policy_net[::2]
    assert [layer.out_features for layer in layers] == [16, 8]
    env = make_environment(agent.config)
    assert env.unwrapped.discount == 0.8
    _, info = env.reset(seed=0)
    *_, info = env.step(int(np.flatnonzero(info["action_mask"])[1]))
    assert info["reward_terms"]["waved"] == 0.5
    capsys.readouterr()
    for wrong, said in (("Nothing", "is a Nothing, not a Task"), ("Missing", "cannot be made")):
        assert main(["train", *out, "--out", str(tmp_path / "x"), "--task", f"{own}:{wrong}"]) == 2
        assert said in capsys.readouterr().err


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"learning_rate": 0.0}, "learning_rate must be positive"),
        ({"network": ()}, "network must be widths"),
        ({"discount": 1.5}, r"discount must be in \(0, 1\]"),
        ({"n_envs": 0}, "n_envs must be at least 1"),
        ({"algorithm": "dqn", "n_envs": 4}, "1 environment at once, not 4"),
    ],
)
def test_settings_that_cannot_be_are_refused(wrong, said):
    with pytest.raises(InvalidValueError, match=said):
        TrainingConfig(**wrong)


def test_one_may_train_where_things_change(tmp_path):
    small = ["--steps", "1", "--round-steps", "1", "--episodes", "1", "--envs", "1"]
    where = ["--env", "v1", "--task", "follow", "--changes", "people", "--people", "test"]
    assert main(["train", "--out", str(tmp_path), *small, *where]) == 0
    env = make_environment(TrainedPolicy.load(tmp_path).config)
    assert env.unwrapped.changes == CHANGES["people"] and env.unwrapped.people == SPLITS["test"]


def test_the_commands(folder, capsys):
    library, out = str(folder / "small.mplearn"), str(folder / "by command")
    small = ["--steps", "1", "--round-steps", "1", "--episodes", "2"]
    assert main(["train", "--library", library, "--out", out, *small]) == 0
    assert "agent written to" in capsys.readouterr().out
    assert main(["perform", "--agent", out, "--dynamics", "kinematic", "--episodes", "2"]) == 0
    assert "of 2 episodes succeeded" in capsys.readouterr().out
