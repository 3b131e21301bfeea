"""The gate in front of every command: emergency stop and lease."""

import pytest

from interfaces.nao import SafetyState
from naoserver.errors import CommandRefused, InvalidCommand
from naoserver.event_log import EventLog
from naoserver.gate import LONGEST_LEASE, Gate

FREE = SafetyState(time=0.0, stopped=False, reason="", holder="", remaining=0.0)


class Rig:
    def __init__(self):
        self.wall = 0.0
        self.events = EventLog(lambda: 0.0, lambda: self.wall)
        self.gate = Gate(self.events)

    def lets_through(self, client=""):
        try:
            self.gate.require(client)
        except CommandRefused:
            return False
        return True

    def messages(self):
        return [event.message for event in self.events.snapshot()[0]]


@pytest.fixture
def rig():
    return Rig()


def test_everybody_may_command_at_first(rig):
    assert rig.lets_through()
    assert rig.lets_through("a")
    assert rig.gate.state() == FREE


def test_an_emergency_stop_latches_until_it_is_reset_and_says_why(rig):
    rig.gate.stop("a hand in the way")
    rig.wall = 1e6
    with pytest.raises(CommandRefused, match=r"a hand in the way.*reset") as refusal:
        rig.gate.require("a")
    assert refusal.value.holder == ""
    assert rig.gate.state() == SafetyState(
        0.0, stopped=True, reason="a hand in the way", holder="", remaining=0.0
    )
    rig.gate.reset()
    assert rig.lets_through("a")
    assert rig.messages()[0] == "emergency stop: a hand in the way"
    assert rig.messages()[-1] == "the emergency stop was reset"


def test_a_stop_without_a_reason_has_one_and_a_long_one_is_cut(rig):
    rig.gate.stop("")
    assert rig.gate.state().reason == "emergency stop"
    rig.gate.stop("x" * 10_000)
    assert len(rig.gate.state().reason) == 200
    rig.gate.stop("two\nlines")
    assert rig.gate.state().reason == "two lines"


def test_commands_are_refused_before_anything_is_stopped_and_every_part_is_stopped(rig):
    seen = []

    def fails():
        seen.append(rig.lets_through())
        raise OSError("no line to the motors")

    rig.gate.on_stop(fails)
    rig.gate.on_stop(lambda: seen.append("stopped"))
    with pytest.raises(OSError, match="no line"):
        rig.gate.stop("now")
    assert seen == [False, "stopped"]
    assert not rig.lets_through()


def test_a_lease_shuts_others_out_until_it_ends(rig):
    rig.gate.acquire("a", "Ann", 5.0)
    rig.wall = 4.9
    assert rig.lets_through("a")
    assert not rig.lets_through("b")
    assert not rig.lets_through()
    assert rig.gate.state().holder == "Ann"
    assert rig.gate.state().remaining == pytest.approx(0.1)
    rig.wall = 5.0
    assert rig.lets_through("b")
    assert rig.gate.state() == FREE


def test_a_lease_is_renewed_by_its_holder_alone(rig):
    rig.gate.acquire("a", "Ann", 5.0)
    rig.wall = 4.0
    with pytest.raises(CommandRefused, match="held by Ann") as refusal:
        rig.gate.acquire("b", "Ann", 5.0)
    assert refusal.value.holder == "Ann"
    rig.gate.acquire("a", "Ann", 5.0)
    rig.wall = 8.0
    assert not rig.lets_through("b")


def test_a_lease_is_given_back_by_its_holder_alone(rig):
    rig.gate.acquire("a", "Ann", 5.0)
    assert not rig.gate.release("b")
    assert not rig.lets_through("b")
    assert rig.gate.release("a")
    assert not rig.gate.release("a")
    assert rig.lets_through("b")


def test_a_refusal_names_the_holder_or_the_stop(rig):
    rig.gate.acquire("a", "Ann", 5.0)
    with pytest.raises(CommandRefused, match="held by Ann") as refusal:
        rig.gate.require("b")
    assert refusal.value.holder == "Ann"
    rig.gate.stop("stop")
    with pytest.raises(CommandRefused, match="stopped: stop") as refusal:
        rig.gate.require("a")
    assert refusal.value.holder == ""


def test_a_stop_leaves_the_lease_with_its_holder(rig):
    rig.gate.acquire("a", "Ann", 5.0)
    rig.gate.stop("stop")
    rig.gate.reset()
    assert rig.lets_through("a")
    assert not rig.lets_through("b")


@pytest.mark.parametrize("seconds", [0.0, -1.0, LONGEST_LEASE + 1, float("nan"), float("inf")])
def test_a_lease_of_no_possible_length_is_refused(rig, seconds):
    with pytest.raises(InvalidCommand, match="seconds"):
        rig.gate.acquire("a", "Ann", seconds)
    assert rig.lets_through("b")


@pytest.mark.parametrize("holder", ["", "  ", "x" * 65, "a\nb"])
def test_a_holder_needs_a_name(rig, holder):
    with pytest.raises(InvalidCommand, match="holder"):
        rig.gate.acquire("a", holder, 1.0)
