"""What every service has, asked without libqi's network."""

import pytest

pytest.importorskip("qi")

from tests.support.limits import CALL_LIMIT
from visualhfsm_naoqi.programs._calls import Calls
from visualhfsm_naoqi.programs._clients import CallTable, Client
from zenoh_ice import WallClock

MILLISECONDS = int(CALL_LIMIT * 1000)


class Arm:
    """Move an arm.

    It is strong.
    """

    def lift(self, height: object, *how: object) -> str:
        """Lift it."""
        return f"{height} {how}"

    def version(self) -> str:
        """Return its own version."""
        return "1"

    def _hidden(self) -> None:
        pass


@pytest.fixture
def arm():
    calls = Calls(CallTable(WallClock()))
    yield calls.facade("ALArm", [Arm()])(Client("test"))
    calls.close()


def test_it_lists_what_can_be_called(arm):
    methods = arm.getMethodList()
    assert {"lift", "getMethodHelp", "pCall", "isRunning", "stop", "ping"} <= set(methods)
    assert all(callable(getattr(arm, method)) for method in methods)
    assert not [method for method in methods if method.startswith("_")]


def test_it_describes_an_operation(arm):
    assert arm.getMethodHelp("lift") == ["lift", "Lift it.", [["height", ""], ["...", ""]]]
    assert arm.getUsage("lift") == "lift(height, ...): Lift it."


def test_it_describes_the_service(arm):
    assert arm.getModuleHelp() == ["ALArm", "Move an arm."]


def test_what_the_service_has_itself_comes_first(arm):
    assert arm.version() == "1"
    assert arm.getMethodHelp("version")[1] == "Return its own version."


@pytest.mark.parametrize("name", ["fly", "_hidden", 7, None, ["lift"]])
def test_an_operation_that_is_none(arm, name):
    future = arm.getMethodHelp(name)
    assert future.wait(MILLISECONDS)
    assert "ALArm::getMethodHelp" in future.error()
