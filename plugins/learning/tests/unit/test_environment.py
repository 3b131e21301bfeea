"""The environments in which a simulated Nao learns: the check of Gymnasium, and the properties of each."""

import math
import re

import gymnasium
import mujoco
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from naoserver.bodies import find_body
from naoserver.bodies.capabilities import WalkVelocity
from naoserver.bodies.nao import H25
from naoserver.moves.motion_file import load_motions
from naoserver_sim.model import build_model
from tests.support.soak import cases
from visualhfsm_learning import ENVIRONMENTS
from visualhfsm_learning._environment import PERIOD
from visualhfsm_learning._tasks import arm_of, hand_at, motors_of, part_of_height

pytestmark = pytest.mark.sim


@pytest.fixture
def make():
    """Make environments that are closed at the end."""
    made = []

    def make(name, **options):
        made.append(gymnasium.make(f"visualhfsm_learning:Nao/{name}-v0", **options))
        return made[-1]

    yield make
    for environment in made:
        environment.close()


def still(environment):
    return np.zeros(environment.action_space.shape, np.float32)


def episode(environment, seed, steps):
    """Return observations and rewards of an episode of random actions."""
    rng = np.random.default_rng(7)
    reported = [environment.reset(seed=seed)[0].tobytes()]
    for _ in range(steps):
        action = rng.uniform(-0.2, 0.2, environment.action_space.shape).astype(np.float32)
        observation, reward, *_ = environment.step(action)
        reported += [observation.tobytes(), reward]
    return reported


@pytest.mark.parametrize("name", ["Walk", "Reach", "StandUp"])
def test_gymnasium_finds_nothing_wrong(make, name):
    assert f"Nao/{name}-v0" in ENVIRONMENTS
    check_env(make(name).unwrapped, skip_render_check=True)


@pytest.mark.parametrize("name", ["Walk", "Reach", "StandUp"])
def test_the_same_seed_is_the_same_episode_bit_by_bit_whatever_was_before(make, name):
    used, fresh = make(name), make(name)
    episode(used, 4, 5)
    first = episode(fresh, 5, 30)
    assert episode(used, 5, 30) == first
    other = episode(used, 6, 5)
    assert other != first[: len(other)]


@pytest.mark.parametrize("body", cases(["T1"], ["G1"]))
@pytest.mark.parametrize("name", ["Walk", "Reach", "StandUp"])
def test_a_humanoid_learns_the_same_episode_bit_by_bit(make, name, body):
    used, fresh = make(name, body=body), make(name, body=body)
    episode(used, 4, 2)
    assert episode(used, 5, 10) == episode(fresh, 5, 10)


@pytest.mark.parametrize(("name", "lacks"), [("Walk", "legs"), ("Reach", "left arm"), ("StandUp", "legs")])
def test_a_body_that_lacks_what_a_task_needs_is_refused(make, name, lacks):
    with pytest.raises(ValueError, match=f"the body Cart has no {lacks}, which this task needs"):
        make(name, body="Cart")


@pytest.mark.parametrize("body", ["H25", "H21", "T1", "G1"])
def test_every_humanoid_is_paid_for_standing_still_and_lies_after_a_fall(make, body):
    environment = make("Walk", body=body, disable_env_checker=True)
    environment.reset(seed=1, options={"velocity": (0.0, 0.0, 0.0)})
    rewards = [environment.step(still(environment))[1] for _ in range(50)]
    assert np.mean(rewards) == pytest.approx(1.2, abs=0.02)
    environment = make("StandUp", body=body, disable_env_checker=True)
    environment.reset(seed=1, options={"side": "back"})
    _, reward, ended, _, reported = environment.step(still(environment))
    assert not ended
    assert reward < 0.5 * PERIOD
    assert reported["torso"][2] < 0.5 * part_of_height(find_body(body), 1.0)


def test_an_action_that_is_too_large_is_clipped(make):
    environment = make("Walk", disable_env_checker=True)
    environment.reset(seed=1)
    observation, reward, *_ = environment.step(np.full(11, 1e30, np.float32))
    assert environment.observation_space.contains(observation)
    assert math.isfinite(reward)


@pytest.mark.parametrize("name", ["Walk", "Reach", "StandUp"])
def test_an_action_of_another_shape_is_refused(make, name):
    environment = make(name, disable_env_checker=True)
    environment.reset(seed=1)
    action = still(environment)
    for wrong in (action[None], action[:-1], np.float32(0.5), np.append(action, 0.0), action[:0]):
        shape = re.escape(f"the action has the shape {np.shape(wrong)}, not {action.shape}")
        with pytest.raises(ValueError, match=shape):
            environment.step(wrong)


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_an_action_that_is_not_finite_is_refused(make, value):
    environment = make("Walk", disable_env_checker=True)
    environment.reset(seed=1)
    action = still(environment)
    action[3] = value
    with pytest.raises(ValueError, match="not finite"):
        environment.step(action)


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        ("Walk", {"velocty": (0.1, 0.0, 0.0)}, "no option 'velocty'; it has 'velocity'"),
        ("Walk", {"velocity": (9, 0, 0)}, "velocity .*9, 0, 0.* is not three numbers"),
        ("Walk", {"velocity": (math.nan, 0, 0)}, "is not three numbers"),
        ("Walk", {"velocity": (0.1, 0.0)}, "is not three numbers"),
        ("Reach", {"position": (0.1, 0.1, 0.1)}, "no option 'position'; it has 'place'"),
        ("Reach", {"place": (0.1, 0.1, 50.0)}, "is not three numbers"),
        ("StandUp", {"side": "left"}, "no side 'left'; there are belly, back"),
    ],
)
def test_options_of_reset_that_mean_nothing_are_refused(make, name, options, message):
    with pytest.raises(ValueError, match=message):
        make(name).reset(seed=1, options=options)


def test_nothing_can_be_done_before_the_first_reset(make):
    environment = make("Reach", disable_env_checker=True).unwrapped
    with pytest.raises(gymnasium.error.ResetNeeded):
        environment.step(np.zeros(5, np.float32))


def test_an_unknown_render_mode_is_refused():
    from visualhfsm_learning._tasks import WalkEnvironment

    with pytest.raises(ValueError, match="rgb_array"):
        WalkEnvironment(render_mode="human")


@pytest.mark.gl
def test_it_is_rendered_as_a_spectator_sees_it(make):
    environment = make("Walk", render_mode="rgb_array")
    environment.reset(seed=1)
    picture = environment.render()
    assert picture.shape == (240, 320, 3)
    assert picture.std() > 5


# -- walking -------------------------------------------------------------------------------------------------


def test_who_stands_still_is_paid_in_full_where_no_velocity_is_wanted(make):
    environment = make("Walk")
    environment.reset(seed=1, options={"velocity": (0.0, 0.0, 0.0)})
    rewards = [environment.step(still(environment))[1] for _ in range(50)]
    assert np.mean(rewards) == pytest.approx(1.2, abs=0.02)
    environment.reset(seed=1, options={"velocity": (0.2, 0.0, 0.0)})
    rewards = [environment.step(still(environment))[1] for _ in range(50)]
    assert np.mean(rewards) == pytest.approx(0.2 + math.exp(-4), abs=0.02)


def test_the_robots_own_walk_is_paid_nearly_in_full(make):
    environment = make("Walk")
    velocity = (0.15, 0.0, 0.2)
    environment.reset(seed=1, options={"velocity": velocity})
    environment.unwrapped.robot.walker.command(WalkVelocity(*velocity))
    rewards = [environment.step(still(environment))[1] for _ in range(200)]
    assert np.mean(rewards[100:]) > 1.1


def test_a_fall_costs_and_ends_the_episode(make):
    environment = make("Walk")
    environment.reset(seed=1)
    forwards = still(environment)
    forwards[4] = forwards[9] = -1.0  # both ankles let the shins fall forwards
    for _ in range(150):
        _, reward, ended, _, reported = environment.step(forwards)
        if ended:
            break
    assert (ended, reward) == (True, -10.0)
    assert reported["torso"][2] < 0.3


# -- reaching ------------------------------------------------------------------------------------------------


def test_where_the_hand_is_agrees_with_the_physics():
    model = build_model(skin=False).mj
    data = mujoco.MjData(model)
    rng = np.random.default_rng(3)
    offset = np.array(H25.effectors["LArm"].position)
    for _ in range(10):
        angles = rng.uniform(-1.0, 1.0, len(arm_of(H25)))
        for name, angle in zip(arm_of(H25), angles, strict=True):
            data.joint(name).qpos[0] = angle
        mujoco.mj_kinematics(model, data)
        torso, hand = data.body("torso"), data.body("l_wrist_hand")
        there = hand.xpos + hand.xmat.reshape(3, 3) @ offset
        expected = torso.xmat.reshape(3, 3).T @ (there - torso.xpos)
        assert hand_at(H25, angles.tolist()) == pytest.approx(expected, abs=1e-9)


def test_the_hand_is_paid_for_being_where_it_is_wanted(make):
    environment = make("Reach", noise=False)
    environment.reset(seed=1)
    observation, *_ = environment.step(still(environment))
    hand = tuple(observation[10:13] / 5.0)
    environment.reset(seed=1, options={"place": hand})
    _, reward, _, _, reported = environment.step(still(environment))
    assert reported["is_success"]
    assert reward == pytest.approx(1.0, abs=0.01)


# -- standing up ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("side", "up"), [("belly", -1.0), ("back", 1.0)])
def test_it_lies_as_it_was_thrown(make, side, up):
    environment = make("StandUp")
    _, reported = environment.reset(seed=1, options={"side": side})
    assert reported["torso"][2] < 0.15
    assert reported["up"][0] == pytest.approx(up, abs=0.2)
    assert set(environment.unwrapped.robot.read().stiffnesses) == {1.0}


def test_it_can_stand_up_by_actions(make):
    environment = make("StandUp", disable_env_checker=True)
    environment.reset(seed=1, options={"side": "belly"})
    robot, motion = (
        environment.unwrapped.robot,
        load_motions(environment.unwrapped.robot.body)["stand_up_from_belly"],
    )
    begin = dict(zip(H25.joint_names, robot.read().commands, strict=True))
    limits = {joint.name: joint.max_velocity for joint in H25.joints}
    for step in range(1, 1000):
        now = dict(zip(H25.joint_names, robot.read().commands, strict=True))
        goal = now | motion.at(step * PERIOD, begin)
        action = [(goal[name] - now[name]) / (0.5 * limits[name] * PERIOD) for name in motors_of(H25)]
        _, reward, ended, _, reported = environment.step(np.array(action, np.float32))
        if ended:
            break
    assert (reported["is_success"], reward) == (True, 50.0)


# -- many at once --------------------------------------------------------------------------------------------


def test_several_at_once_are_each_as_by_itself(make):
    vector = gymnasium.make_vec("visualhfsm_learning:Nao/Walk-v0", num_envs=2)
    try:
        together, _ = vector.reset(seed=5)  # and 6
        for seed, observation in zip((5, 6), together, strict=True):
            assert (make("Walk").reset(seed=seed)[0] == observation).all()
        observations, rewards, *_ = vector.step(np.zeros((2, 11), np.float32))
        assert observations.shape == (2, 46)
        assert np.isfinite(rewards).all()
    finally:
        vector.close()


@pytest.mark.parametrize(("name", "moved"), [("Walk", 11), ("Reach", 4), ("StandUp", 21)])
def test_an_h21_learns_with_the_joints_that_it_has(name, moved):
    with gymnasium.make(f"visualhfsm_learning:Nao/{name}-v0", body="H21") as environment:
        assert environment.action_space.shape == (moved,)
        observation, _ = environment.reset(seed=1)
        assert observation.shape == environment.observation_space.shape
        observation, *_ = environment.step(environment.action_space.sample())
        assert environment.observation_space.contains(observation)
