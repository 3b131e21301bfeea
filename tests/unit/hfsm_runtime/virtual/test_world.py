"""What surrounds a component: stand-ins for what nobody serves, or calls that fail."""

from __future__ import annotations

import pytest

from hfsm_runtime import Automaton, Component, Proxy, State
from hfsm_runtime.virtual import VirtualWorld, make_stub
from interfaces.nao import HeadPose, PoseHeadPrx, SafetyPrx
from tests.support.automata import automaton
from tests.support.gripper import GripperPrx
from zenoh_ice import ConnectionLostException, ObjectNotExistException


class Uses(Component, document="uses.xml"):
    Hand = Proxy("Hand", GripperPrx)
    Head = Proxy("Head", PoseHeadPrx)

    def automaton(self) -> Automaton:
        return automaton(1, "uses", [State(id=1, name="idle")])


def test_a_call_that_nobody_serves_says_what_is_served() -> None:
    world, component = VirtualWorld(), Uses()
    world.stub(component, "Hand", {"close": 1.0})
    world.connect(component)
    with pytest.raises(ObjectNotExistException, match="there is no servant Head; there are Hand"):
        component.Head.getPose()
    world.close()


def test_a_stand_in_answers_with_blank_values_and_streams_them() -> None:
    world, component = VirtualWorld(stand_ins=True), Uses()
    world.connect(component)
    hand = component.Hand
    assert [hand.close(2.0), hand.text(3), hand.positions(), hand.stop()] == [0.0, "", [0.0], None]
    sample = component.Head.getPose.latest()
    assert sample is not None
    assert sample.value == HeadPose()
    world.close()


@pytest.mark.parametrize(
    ("robot", "lacks"), [([], ""), (["Safety"], "; this robot does not serve Head (PoseHead)")]
)
def test_a_stand_in_for_what_a_robot_lacks_says_so(
    caplog: pytest.LogCaptureFixture, robot: list[str], lacks: str
) -> None:
    world, component = VirtualWorld(stand_ins=True), Uses()
    world.stub(component, "Hand", {})
    for identity in robot:
        world.network.serve(identity, *make_stub(identity, SafetyPrx.ice_interface, {}))
    world.connect(component)
    assert caplog.messages == [f"self.Head is a stand-in, which answers with zeros and empty texts{lacks}"]
    world.close()


def test_a_servant_of_another_interface_gives_way_to_a_stand_in() -> None:
    world, component = VirtualWorld(stand_ins=True), Uses()
    world.network.serve("Head", *make_stub("Head", GripperPrx.ice_interface, {}))
    world.connect(component)
    assert component.Head.getPose() == HeadPose()
    world.close()


class Meets(Component, document="meets.xml"):
    mine = Proxy("Head", PoseHeadPrx)
    named = Proxy("Head@nao", PoseHeadPrx)
    theirs = Proxy("Head@other", PoseHeadPrx)

    def automaton(self) -> Automaton:
        return automaton(1, "meets", [State(id=1, name="idle")])


@pytest.mark.parametrize("stand_ins", [False, True])
def test_a_servant_of_another_realm_is_another_servant(*, stand_ins: bool) -> None:
    world, component = VirtualWorld(stand_ins=stand_ins), Meets()
    world.stub(component, "Head", {"getPose": HeadPose(pan=1.0)})
    if not stand_ins:
        world.stub(component, "Head@other", {"getPose": HeadPose(pan=2.0)})
    world.connect(component)
    assert component.mine.getPose() == component.named.getPose() == HeadPose(pan=1.0)
    assert component.theirs.getPose() == HeadPose(pan=0.0 if stand_ins else 2.0)
    sample = component.theirs.getPose.latest()
    assert sample is not None
    assert sample.value == component.theirs.getPose()
    assert {each.target for each in world.journal.calls()} == {"Head.getPose", "Head@other.getPose"}
    with world.offline("Head@other"):
        with pytest.raises(ConnectionLostException, match="Head@other is offline"):
            component.theirs.getPose()
        component.mine.getPose()
    world.close()
