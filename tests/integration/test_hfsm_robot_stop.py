"""What a component that ends stops of what it has begun."""

from __future__ import annotations

from hfsm_runtime import Automaton, Component, Proxy, State
from hfsm_runtime.robot import connect, stop_robot
from interfaces.jderobot import MotorsPrx
from interfaces.nao import PoseHeadPrx, SpeechPrx
from naoserver.fake import FakeRobot
from tests.support.robot_server import eventually, served_to_client


class Busy(Component):
    Head = Proxy("Head", PoseHeadPrx)
    Walk = Proxy("Motors", MotorsPrx)
    Voice = Proxy("Speech", SpeechPrx)

    def automaton(self) -> Automaton:
        return Automaton(id=1, name="nothing", states=(State(id=1, name="idle", initial=True),))


def test_a_component_that_ends_stops_head_walk_and_voice() -> None:
    with served_to_client(FakeRobot()) as nao:
        component = Busy()
        connect(component, nao.communicator)
        component.Head.setPose(1.5, 0.0, 0.05)
        component.Walk.setV(0.1)
        component.Voice.say("This takes quite some time to be said. " * 20)
        assert component.Voice.getSpeech().speaking
        stop_robot(component)
        assert component.Walk.getV() == 0.0
        assert not component.Voice.getSpeech().speaking
        eventually(lambda: abs(component.Head.getPose().panSpeed) < 0.01)
        assert component.Head.getPose().pan < 1.4
