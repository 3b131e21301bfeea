"""Masses and inertias that no body can have are repaired, and it is said."""

import mujoco
import numpy as np
import pytest

from naoserver.errors import RobotError
from visualhfsm_own_robots._model_file import LEAST_MASS, balance_inertias


def arm(inertia="1 1 1", mass="1", more="<joint/>", geom=""):
    """A link on a base; `inertia` are its moments, and three products of inertia if there are six numbers."""
    given = "fullinertia" if len(inertia.split()) == 6 else "diaginertia"
    inertial = f'<inertial pos="0 0 0.1" mass="{mass}" {given}="{inertia}"/>' if inertia else ""
    return mujoco.MjSpec.from_string(
        '<mujoco><worldbody><body name="base"><geom size="0.1"/>'
        f'<body name="arm">{more}{inertial}{geom}</body></body></worldbody></mujoco>'
    )


def balanced(spec, balance=None, free=False):
    return list(balance_inertias(spec, lambda body: "r.xml:3", balance, free=free))


def moments(spec):
    mj = spec.compile()
    return mj.body("arm").mass[0], sorted(mj.body("arm").inertia.tolist())


@pytest.mark.sim
@pytest.mark.parametrize("inertia", ["1 1 1", "0.1 1 1", "1 1 1.9", "0.4 0.5 0.6 0.1 0 0"])
def test_what_bodies_can_have_stays(inertia):
    plain, kept = arm(inertia), arm(inertia)
    assert balanced(kept) == []
    assert moments(kept) == moments(plain)


@pytest.mark.sim
@pytest.mark.parametrize(
    ("inertia", "repaired"),
    [
        ("0.1 0.2 1", [0.45, 0.55, 1.0]),
        ("0.5 0.5 1.01", [0.505, 0.505, 1.01]),
        ("-0.1 1 1", [0.0, 1.05, 1.05]),
        ("0.1 0.2 1 0 0 0", [0.45, 0.55, 1.0]),
        ("0.55 0.55 0.2 0.45 0 0", [0.45, 0.55, 1.0]),
    ],
)
def test_an_impossible_inertia_becomes_the_nearest_that_is_possible(inertia, repaired):
    spec = arm(inertia)
    (note,) = balanced(spec)
    assert moments(spec)[1] == pytest.approx(repaired, abs=2e-5)
    assert note.startswith("r.xml:3: the inertia of 'arm' has the moments ")
    assert "balance = true" in note


def test_the_axes_of_a_repaired_inertia_stay():
    spec = arm("0.55 0.55 0.2 0.45 0 0")
    balanced(spec)
    xx, yy, _, xy, *_ = spec.body("arm").fullinertia
    assert (xx, yy) == pytest.approx((0.725, 0.725), abs=1e-4)
    assert xy == pytest.approx(0.275, abs=1e-4)


@pytest.mark.sim
@pytest.mark.parametrize("inertia", ["0 1 1", "1 1 2", "0.1 0.9 1.00000001"])
def test_rods_and_plates_need_no_word(inertia):
    spec = arm(inertia)
    assert balanced(spec) == []
    assert moments(spec)[1] == pytest.approx(sorted(map(float, inertia.split())), abs=1e-5)


@pytest.mark.sim
def test_the_user_says_whether_they_are_repaired():
    spec = arm("0.1 0.2 1")
    assert balanced(spec, balance=True) == []
    assert moments(spec)[1] == pytest.approx([0.45, 0.55, 1.0], abs=2e-5)
    with pytest.raises(RobotError, match=r"r\.xml:3: .*moments 0\.1, 0\.2, 1, which .*balance = true"):
        balanced(arm("0.1 0.2 1"), balance=False)


@pytest.mark.sim
@pytest.mark.parametrize(("inertia", "mass"), [("", ""), ("0 0 0", "0"), ("0 0 0", "1e-9")])
def test_a_link_that_moves_without_mass_becomes_a_small_ball(inertia, mass):
    spec = arm(inertia, mass)
    (note,) = balanced(spec)
    assert note.startswith("'arm' without mass or inertia: taken as a ball, of at least 0.01 kg")
    mass, (least, _, most) = moments(spec)
    assert mass == LEAST_MASS
    assert 0.0 < least == pytest.approx(most)


@pytest.mark.sim
def test_a_link_with_mass_alone_becomes_a_ball_of_water():
    spec = arm("0 0 0", "2")
    balanced(spec)
    mass, found = moments(spec)
    assert mass == 2.0
    assert found == pytest.approx([0.4 * 2.0 * 0.0782**2] * 3, rel=1e-2)


@pytest.mark.sim
@pytest.mark.parametrize(("inertia", "mass"), [("0 0 0", "0"), ("0 0 0", "1e-9"), ("", "")])
def test_a_fixed_frame_has_no_mass(inertia, mass):
    spec = arm(inertia, mass, more="")
    balanced(spec)
    assert moments(spec) == (0.0, [0.0, 0.0, 0.0])


@pytest.mark.parametrize("more", ['<geom size="0.1"/>', '<body name="tool"><geom size="0.1"/></body>'])
def test_shapes_and_what_is_fixed_to_a_link_give_it_mass(more):
    assert balanced(arm("", geom=more)) == []


def test_a_root_that_is_not_fixed_needs_mass():
    spec = mujoco.MjSpec.from_string('<mujoco><worldbody><body name="base"/></worldbody></mujoco>')
    assert balanced(spec) == []
    assert "'base' without mass" in balanced(spec, free=True)[0]


def test_as_many_links_may_be_fixed_to_another_as_a_robot_has():
    spec = arm("")
    body = spec.body("arm")
    for number in range(900):
        body = body.add_body(name=f"frame {number}")
    assert balanced(spec) == [
        "'arm' without mass or inertia: taken as a ball, of at least 0.01 kg where they move"
    ]


def test_a_mass_below_0_is_refused():
    with pytest.raises(RobotError, match=r"r\.xml:3: the mass of 'arm' is -1: write 0 or more"):
        balanced(arm(mass="-1"))


@pytest.mark.sim
def test_a_long_list_of_names_is_cut():
    bodies = "".join(f'<body name="b{number}"><joint/></body>' for number in range(9))
    spec = mujoco.MjSpec.from_string(
        f'<mujoco><worldbody><body name="a">{bodies}</body></worldbody></mujoco>'
    )
    assert "'b5' and 3 more without mass" in balanced(spec)[0]
    assert np.all(spec.compile().body_mass[2:] == LEAST_MASS)
