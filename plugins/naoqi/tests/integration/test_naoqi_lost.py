"""Lights, voice and sounds of a real robot that is lost, as clients use them."""

import pytest

from interfaces.jderobot import CommandRefusedException
from interfaces.nao import LedColor, LedsPrx, SoundsPrx, SpeechPrx
from plugins.naoqi.tests.support.scripted import ScriptedNaoqi
from tests.support.robot_server import served_to_client
from visualhfsm_naoqi.robot._robot import NaoqiRobot

RED = LedColor(red=1.0, green=0.0, blue=0.0)


@pytest.fixture
def lost():
    """A real robot that its server has just lost, and a client's session."""
    naoqi = ScriptedNaoqi()
    with served_to_client(NaoqiRobot(naoqi.connect)) as nao:
        naoqi.lose()
        yield nao


COMMANDS = {
    "setLed": lambda nao: nao.proxy(LedsPrx, "Leds").setLed("LeftEye", RED, 0.0),
    "reset": lambda nao: nao.proxy(LedsPrx, "Leds").reset(),
    "say": lambda nao: nao.proxy(SpeechPrx, "Speech").say("Hello."),
    "play": lambda nao: nao.proxy(SoundsPrx, "Sounds").play("beep", 0.5),
    "playTone": lambda nao: nao.proxy(SoundsPrx, "Sounds").playTone(440.0, 0.1, 0.5),
}


@pytest.mark.parametrize("command", COMMANDS)
def test_a_lost_robot_refuses_to_shine_and_to_sound_and_says_why(lost, command):
    with pytest.raises(CommandRefusedException, match="the robot is not connected") as refusal:
        COMMANDS[command](lost)
    assert refusal.value.holder == ""
