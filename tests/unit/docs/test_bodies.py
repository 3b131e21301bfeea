"""The page of bodies says what their facts files say."""

import re

import pytest

from naoserver.bodies import BODY_NAMES, find_body
from naoserver.bodies.footsteps import Footsteps
from naoserver.bodies.parts import Wheels
from tests.support.places import ROOT

PAGE = (ROOT / "docs" / "reference" / "bodies.md").read_text(encoding="utf-8")


def test_it_lists_all_bodies():
    assert tuple(re.findall(r"^\| `(\w+)` \| [^|]+ \| \d+ \|", PAGE, re.MULTILINE)) == BODY_NAMES


@pytest.mark.parametrize("name", BODY_NAMES)
def test_its_figures_are_those_of_the_body(name):
    body = find_body(name)
    row = next(line for line in PAGE.splitlines() if line.startswith(f"| `{name}`"))
    _, _, _, joints, mass, way, _, postures, _ = (cell.strip() for cell in row.split("|"))
    assert int(joints) == len(body.joints)
    assert mass == f"{body.mass:.1f} kg"
    assert postures in (", ".join(body.postures) or "none", str(len(body.postures)))
    if isinstance(body.walk, Wheels):
        assert way == f"wheels: {body.walk.fastest:g} m/s, {body.walk.fastest_turn:g} rad/s"
    if isinstance(body.walk, Footsteps):
        assert way == f"footsteps: {body.walk.limits.forward:g} m/s, {body.walk.limits.turn:g} rad/s"


def test_it_explains_each_hinge_of_a_humanoid():
    explained = set(re.findall(r"`(\w+)`", PAGE.split("## Axes of the hinges")[1].split("##")[0]))
    for name in ("T1", "G1"):
        assert find_body(name).hinges.keys() - {"LeftWrist", "RightWrist"} <= explained
