import mujoco
import pytest

from naoserver.bodies.nao import H25
from naoserver_sim._walk.walker import Trim
from naoserver_sim.model import build_model

pytestmark = pytest.mark.sim

FORWARD = {"LShoulderPitch": 0.0, "RShoulderPitch": 0.0}


@pytest.fixture(scope="module")
def mj():
    return build_model(skin=False).mj


def posed(mj, joints):
    """Return a trim that has just begun, and the data in which arms and head are where the joints have them."""
    data = mujoco.MjData(mj)
    for name, angle in (dict(H25.postures["StandInit"].angles) | joints).items():
        data.joint(name).qpos[0] = angle
    mujoco.mj_kinematics(mj, data)
    trim = Trim(mj, data, H25)
    trim.begin()
    return trim, data


def whole_body(mj, joints):
    """Return MuJoCo's own center of mass of the whole body in the torso's frame."""
    _, data = posed(mj, joints)
    mujoco.mj_comPos(mj, data)
    torso = data.body("torso")
    return torso.xmat.reshape(3, 3).T @ (data.subtree_com[torso.id] - torso.xpos)


def test_nothing_is_shifted_while_the_arms_hang_as_in_stand_init(mj):
    trim, _ = posed(mj, {})
    assert trim.shift == pytest.approx((0.0, 0.0), abs=1e-9)


@pytest.mark.parametrize("joints", [FORWARD, {"LShoulderRoll": 1.2}, {"HeadPitch": 0.5, "RElbowRoll": 1.5}])
def test_the_shift_is_that_of_the_center_of_mass_of_the_whole_body(mj, joints):
    trim, _ = posed(mj, joints)
    moved = whole_body(mj, joints) - whole_body(mj, {})
    assert trim.shift == pytest.approx(tuple(moved[:2]), abs=1e-6)
    assert max(map(abs, trim.shift)) > 0.001


def test_it_follows_little_by_little(mj):
    trim, data = posed(mj, {})
    for joint, angle in FORWARD.items():
        data.joint(joint).qpos[0] = angle
    mujoco.mj_kinematics(mj, data)
    trim.tick(0.01)
    first = trim.shift[0]
    for _ in range(300):
        trim.tick(0.01)
    assert 0.0 < first < 0.1 * trim.shift[0]
