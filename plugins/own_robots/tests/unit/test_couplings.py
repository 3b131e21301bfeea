"""Which joints of a user's model have motors, which move together, and where links close loops."""

import mujoco
import numpy as np
import pytest

from naoserver.bodies.parts import Coupling
from naoserver.errors import RobotError
from visualhfsm_own_robots._couplings import Pull, couplings_of, keep_in_range, loops_of
from visualhfsm_own_robots._looks import Frame
from visualhfsm_own_robots._model_file import ModelFile

pytestmark = pytest.mark.sim


def model(below, joints="abc"):
    """Return a compiled model: a chain of links with hinges, and what stands below its <worldbody>."""
    chain = "".join(
        f'<body name="link_{name}" pos="0 0 0.1"><joint name="{name}" axis="0 1 0"/>'
        f'<site name="site_{name}" pos="0.01 0 0" quat="0 1 0 0"/><geom size="0.01" mass="0.1"/>'
        for name in joints
    )
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><worldbody><body name="root"><freejoint/><geom size="0.1" mass="1"/><site name="site_root"/>'
        f"{chain}{'</body>' * (len(joints) + 1)}</worldbody>{below}</mujoco>"
    )


def found(below, joints="abc", lines=()):
    return couplings_of(
        ModelFile(mujoco.MjSpec(), lines=dict(lines), compiled=model(below, joints), where="r.xml")
    )


def equal(first, second, coefficients="0 1 0 0 0"):
    return f'<equality><joint joint1="{first}" joint2="{second}" polycoef="{coefficients}"/></equality>'


def motors(*names):
    return (
        "<actuator>" + "".join(f'<motor name="m_{name}" joint="{name}"/>' for name in names) + "</actuator>"
    )


def tendon(name, **coefficients):
    parts = "".join(f'<joint joint="{joint}" coef="{by}"/>' for joint, by in coefficients.items())
    return f'<tendon><fixed name="{name}">{parts}</fixed></tendon>'


def by_tendon(*names):
    return (
        "<actuator>" + "".join(f'<motor name="m_{name}" tendon="{name}"/>' for name in names) + "</actuator>"
    )


def pairs(couplings):
    return {
        (each.leader, each.follower): pytest.approx((each.ratio, each.offset)) for each in couplings.couplings
    }


def test_an_equality_is_a_coupling_with_its_ratio_and_offset():
    assert pairs(found(equal("b", "a", "0.1 -2 0 0 0"))) == {("a", "b"): (-2.0, 0.1)}


def test_who_follows_a_follower_follows_its_leader():
    chain = equal("b", "a", "0.1 -2 0 0 0") + equal("c", "b", "0.5 3 0 0 0")
    assert pairs(found(chain)) == {("a", "b"): (-2.0, 0.1), ("a", "c"): (-6.0, 0.8)}


def test_the_joint_with_the_motor_leads():
    kept = found(equal("b", "a", "0.1 -2 0 0 0") + motors("b"))
    assert pairs(kept) == {("b", "a"): (-0.5, 0.05)}
    assert (kept.pulls, kept.passive) == ({"b": (Pull(0),)}, {"c"})


def test_a_second_motor_of_coupled_joints_is_named():
    kept = found(equal("b", "a") + motors("a", "b"), "ab")
    assert kept.notes == ("r.xml: the actuator 'm_b' is left out: joint 'b' follows another one",)


def test_an_equality_that_is_no_proportion_is_named_with_its_line():
    kept = found(equal("b", "a", "0 1 2 0 0"), lines={("joint", "b"): 7})
    assert kept.couplings == ()
    assert kept.notes == (
        "r.xml:7: the equality of joint 'b' is left out: it does not bind two joints in proportion",
    )


def test_a_joint_without_a_motor_is_passive_where_others_have_one():
    assert found("").passive == frozenset()
    kept = found(motors("b"))
    assert kept.passive == {"a", "c"}
    assert "no actuator moves a, c: passive" in kept.notes[0]


def test_an_actuator_may_have_several_controls():
    both = found('<actuator><pid name="m" joint="a" kp="3"/><muscle joint="c" lengthrange="0 1"/></actuator>')
    assert both.pulls == {"a": (Pull(0),), "c": (Pull(1),)}
    assert both.notes[0] == "r.xml: the muscles 1 are servos here, which pull and push"


def test_an_equality_of_tendons_over_one_joint_each_is_a_coupling():
    both = tendon("t", a=2) + tendon("u", c=0.5)
    bound = '<equality><tendon tendon1="u" tendon2="t" polycoef="0.1 3 0 0 0"/></equality>'
    assert pairs(found(both + bound)) == {("a", "c"): (12.0, 0.2)}


def test_a_tendon_with_a_motor_couples_its_joints_by_their_coefficients():
    kept = found(tendon("t", a=2, b=-1) + by_tendon("t"), "ab")
    assert pairs(kept) == {("a", "b"): (-0.5, 0.0)}
    assert kept.pulls == {"a": (Pull(0, 2.5),)}  # 2 at the one, and half of 1 at the other


def test_a_tendon_drives_joints_that_an_equality_binds():
    kept = found(tendon("t", a=1, b=1) + equal("b", "a", "0 0.5 0 0 0") + by_tendon("t"), "ab")
    assert kept.pulls == {"a": (Pull(0, 1.5),)}


def test_two_tendons_of_a_differential_drive_each_of_its_joints():
    kept = found(tendon("t", a=1, b=1) + tendon("u", a=1, b=-1) + by_tendon("t", "u"), "ab")
    assert kept.couplings == ()
    assert kept.pulls == {"a": (Pull(0), Pull(1)), "b": (Pull(0), Pull(1))}


def test_more_tendons_than_can_be_compared_are_refused():
    many = [f"t{number}" for number in range(101)]
    below = "".join(tendon(name, a=1) for name in many) + by_tendon(*many)
    with pytest.raises(RobotError, match=r"101 actuators pull at tendons over joints: at most 100 may"):
        found(below)


def test_a_tendon_moves_the_one_joint_that_has_no_motor_of_its_own():
    below = tendon("t", a=1, b=-3) + '<actuator><motor joint="a"/><motor tendon="t"/></actuator>'
    assert found(below, "ab").pulls == {"a": (Pull(0),), "b": (Pull(1, 3.0),)}


@pytest.mark.parametrize(
    ("below", "named"),
    [
        (
            tendon("t", a=1) + motors("a") + by_tendon("t"),
            "the actuator 'm_t' is left out: the joints of its tendon have motors",
        ),
        (
            '<actuator><general name="jet" site="site_a" gear="0 0 1 0 0 0"/></actuator>',
            "the actuator 'jet' is left out: it acts on no joint",
        ),
        (
            '<actuator><muscle name="calf" joint="a" lengthrange="0.1 1"/></actuator>',
            "the muscles calf are servos here, which pull and push",
        ),
        (
            '<tendon><spatial name="t"><site site="site_a"/><site site="site_b"/></spatial></tendon>',
            "the tendon 't' is left out: it runs along sites, not over joints",
        ),
    ],
)
def test_what_is_not_kept_is_named(below, named):
    assert any(named in note for note in found(below).notes)


def tables(**ranges):
    return [
        {"name": name, "lower": low, "upper": high, "max_velocity": 2.0, "max_torque": 1.0}
        for name, (low, high) in ranges.items()
    ]


def test_a_leader_moves_only_as_far_and_as_fast_as_its_followers():
    joints = tables(a=(-1.0, 1.0), b=(-1.0, 1.0))
    keep_in_range(joints, [Coupling(leader="a", follower="b", ratio=-2.0, offset=0.5)], "r.xml")
    leader, follower = joints
    assert (leader["lower"], leader["upper"], leader["max_velocity"]) == (-0.25, 0.75, 1.0)
    assert (follower["lower"], follower["upper"], follower["max_velocity"]) == (-1.0, 1.0, 2.0)
    assert follower["max_torque"] == 0.5


def test_a_leader_without_an_end_gets_its_followers():
    joints = [{"name": "a", "max_velocity": 1.0, "max_torque": 1.0}, *tables(b=(-1.0, 0.0))]
    keep_in_range(joints, [Coupling(leader="a", follower="b", ratio=2.0)], "r.xml")
    assert (joints[0]["lower"], joints[0]["upper"]) == (-0.5, 0.0)


def test_ranges_that_do_not_meet_are_refused():
    joints = tables(a=(-1.0, 1.0), b=(2.0, 3.0))
    with pytest.raises(
        RobotError, match=r"r\.xml: joint 'b' follows 'a', which moves from -1 to 1, but must be"
    ):
        keep_in_range(joints, [Coupling(leader="a", follower="b")], "r.xml")


def held(equality):
    """Return what holds links together, where the frame of each link is 0.1 m above that of its body."""
    mj = model(f"<equality>{equality}</equality>", "ab")
    frames = {body: Frame(mj.body(body).name, np.array([0, 0, 0.1])) for body in range(1, mj.nbody)}
    file = ModelFile(mujoco.MjSpec(), lines={("body", "link_b"): 9}, compiled=mj, where="r.xml")
    return loops_of(file, frames)


def test_a_connect_is_a_loop_at_a_place_of_both_links():
    (loop,) = held('<connect body1="link_b" body2="root" anchor="0.01 0 0"/>').loops
    assert (loop["first"], loop["second"], loop.keys() & {"turn"}) == ("link_b", "root", set())
    assert (loop["place"], loop["other"]) == (pytest.approx((0.01, 0, -0.1)), pytest.approx((0.01, 0, 0.1)))


def test_a_weld_is_a_loop_that_cannot_turn():
    (loop,) = held('<weld body1="link_b" body2="root" anchor="0.01 0 0"/>').loops
    assert (loop["place"], loop["other"]) == (pytest.approx((0.01, 0, -0.3)), pytest.approx((0.01, 0, -0.1)))
    assert loop["turn"] == pytest.approx((1.0, 0.0, 0.0, 0.0))


def test_a_connect_of_sites_is_a_loop_where_they_are():
    (loop,) = held('<connect site1="site_a" site2="site_root"/>').loops
    assert (loop["place"], loop["other"]) == (pytest.approx((0.01, 0, -0.1)), pytest.approx((0, 0, -0.1)))


def test_a_root_that_is_welded_to_the_world_is_mounted():
    assert held('<weld body1="root"/>')[:2] == ((), True)


def test_a_link_that_is_held_to_the_world_is_named_with_its_line():
    loops, mounted, notes = held('<connect body1="link_b" anchor="0 0 0"/>')
    assert (loops, mounted) == ((), False)
    assert notes == (
        "r.xml:9: an equality that holds 'link_b' is left out: its other end is no link of the robot",
    )
