"""The ways of makers' programs into `naoserver-sim`."""

import pytest

from naoserver.errors import RobotError
from naoserver.serving.entrances import find_entrances
from naoserver_sim._command import app
from tests.support.commands import run_here
from tests.support.processes import free_endpoint
from tools.workspace import EXTRAS
from visualhfsm_makers import BOOSTER, UNITREE


@pytest.mark.parametrize(("maker", "entrance"), [("unitree", UNITREE), ("booster", BOOSTER)])
def test_naoserver_sim_finds_them(maker, entrance):
    assert entrance in find_entrances()
    assert entrance.asked_by == maker
    assert EXTRAS[maker] == ["visualhfsm-makers"]


def test_each_robot_serves_its_makers_programs_in_a_domain_of_its_own():
    assert [UNITREE.apart["dds_domain"](7, number) for number in range(2)] == [7, 8]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("option", "why"),
    [
        ("--unitree", "--unitree beside [security]: programs of Unitree"),
        ("--booster", "--booster beside [security]: programs of Booster"),
    ],
)
def test_they_are_not_served_beside_roles(tmp_path, option, why):
    secured = tmp_path / "robot.toml"
    secured.write_text('[security]\nuser = "robot"\npassword = "secret"\n')
    options = ("--config", str(secured), "--listen", free_endpoint(), option)
    done = run_here(app, "naoserver-sim", *options, expected=(RobotError,), columns=300)
    assert done.returncode == 1
    assert f"{why} have no passwords" in done.stderr
