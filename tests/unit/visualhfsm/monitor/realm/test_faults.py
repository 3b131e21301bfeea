"""What can fail, and what fails: it comes over the network, and is checked before the page gets it."""

from __future__ import annotations

import asyncio
import math
from contextlib import closing

import pytest

from hfsm_runtime.recording_file import messages as recorded
from interfaces.nao import Fault, FaultKind, FaultState
from naoserver.fake import FakeRobot
from naoserver.options import ServerOptions
from naoserver.serving._faults import FaultsI
from naoserver.serving.assembly import Assembly
from tests.support.robot_server import eventually
from tests.support.suite import Pair
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._monitor.realm.faults import NOTHING, FaultMonitor, alike
from visualhfsm._monitor.steering import set_faults
from zenoh_ice import WallClock

STUCK = FaultKind(name="stuck", text="it does not turn any more, whatever its motor does")
WEAK = FaultKind(name="weak", text="its motor gives only a share of its torque", unit="share", greatest=1.0)


def test_parts_that_fail_in_the_same_ways_share_what_is_said_of_them() -> None:
    found = alike({"HeadYaw": [STUCK, WEAK], "Wheel": [STUCK], "HeadPitch": [STUCK, WEAK], "Mast": []})
    assert [(each.parts, [kind.name for kind in each.kinds]) for each in found] == [
        (["HeadYaw", "HeadPitch"], ["stuck", "weak"]),
        (["Wheel"], ["stuck"]),
    ]
    assert str(found[0].kinds[0].text) == STUCK.text
    assert (found[0].kinds[1].unit, found[0].kinds[1].greatest) == ("share", 1.0)


@pytest.mark.parametrize("name", ["", "Head\nYaw", "x" * 1000])
def test_what_has_no_sound_name_is_left_out(name: str) -> None:
    (found,) = alike({name: [STUCK], "HeadYaw": [FaultKind(name=name, text="odd"), STUCK]})
    assert (found.parts, [kind.name for kind in found.kinds]) == (["HeadYaw"], ["stuck"])


@pytest.mark.parametrize("number", [math.nan, math.inf])
def test_what_has_no_finite_range_is_left_out(number: float) -> None:
    assert alike({"HeadYaw": [FaultKind(name="weak", text="odd", unit="share", greatest=number)]}) == []


def test_long_texts_are_cut_and_only_so_many_parts_are_shown() -> None:
    odd = FaultKind(name="odd", text="x" * 9000, unit="y" * 9000)
    (found,) = alike({f"part{number}": [odd] * 500 for number in range(5000)})
    assert len(found.parts) <= 1000
    assert len(found.kinds) <= 50
    assert len(str(found.kinds[0].text)) <= 200
    assert len(found.kinds[0].unit) <= 64


@pytest.mark.slow
def test_a_robot_that_comes_and_goes_is_asked_what_can_fail(pair: Pair) -> None:
    monitor = FaultMonitor(pair.client)
    monitor.update()
    assert monitor.failing() == NOTHING
    with pytest.raises(VisualHfsmError, match="no robot here whose parts can be made to fail"):
        asyncio.run(set_faults(pair.client, "heal", {}))

    def knows() -> bool:
        monitor.update()
        return bool(monitor.failing().can)

    with closing(FakeRobot()) as robot:
        servant = Assembly(robot, ServerOptions(), WallClock()).servants["Faults"]
        assert isinstance(servant, FaultsI)
        pair.adapter.add(servant, "Faults")
        eventually(knows)
        asyncio.run(set_faults(pair.client, "inject", {"part": "HeadYaw", "kind": "stuck", "amount": None}))
        assert ("HeadYaw", "stuck") in robot.faults.current()
        sound, odd = (Fault(part="Sonar", kind="dead", amount=each) for each in (0.0, math.nan))
        servant.getFaultsPublisher.publish(FaultState(faults=[odd, sound]))
        eventually(lambda: monitor.failing().now == (recorded.Fault("Sonar", "dead"),))
        pair.adapter.removeAll(["Faults"])
        eventually(lambda: not knows())
        assert monitor.failing() == NOTHING
