"""A real robot that was stopped stays stopped, whatever happens to its server."""

import pytest

pytest.importorskip("qi", reason="a real robot needs libqi: pip install 'visualhfsm[naoqi]'")

from plugins.naoqi.tests.support.robots import fake_as_naoqi
from tests.faults.test_robot_stops import kill, known, server
from zenoh_ice import Communicator, initialize


@pytest.fixture
def client(by_environment, endpoint):
    with initialize(connect=[endpoint], clock="wall") as communicator:
        yield communicator


def test_a_real_robot_that_was_stopped_neither_moves_nor_stands_up_when_its_server_is_started_again(
    endpoint: str, client: Communicator
) -> None:
    with fake_as_naoqi(speed=3.0) as url:
        stand = ("--robot", url, "--start", "stand")
        with server("visualhfsm_naoqi.robot", endpoint, *stand) as process:
            known(client).emergencyStop("a hand in the way")
            kill(process)
        with server("visualhfsm_naoqi.robot", endpoint, *stand) as process:
            process.wait_for("the robot is still stopped: it stays as it is")
            assert "a hand in the way" in known(client).getSafetyState().reason
