"""The gate in front of every command: emergency stop and lease."""

import pytest
from msgspec.structs import replace

from interfaces.nao import HealthEvent, SafetyState, Severity
from naoserver.errors import CommandRefused, InvalidCommand
from naoserver.safety._event_log import EventLog
from naoserver.safety._gate import LONGEST_LEASE, Gate


class Rig:
    def __init__(self, **options):
        self.wall = 0.0
        self.robot_time = 0.0
        self.events = EventLog(lambda: self.robot_time, lambda: self.wall)
        self.gate = Gate(self.events, **options)

    def lets_through(self, client=""):
        try:
            self.gate.require(client)
        except CommandRefused:
            return False
        return True

    def refusal(self, client=""):
        with pytest.raises(CommandRefused) as refusal:
            self.gate.require(client)
        return str(refusal.value)

    def state(self):
        """Return the state without what only distinguishes servers."""
        return replace(self.gate.state(), session="", wasReset=False)

    def messages(self):
        return [event.message for event in self.events.snapshot()[0]]

    def newest_event(self):
        return self.events.snapshot()[0][-1]


@pytest.fixture
def rig():
    return Rig()


def test_everybody_may_command_at_first(rig):
    assert rig.lets_through()
    assert rig.lets_through("a")
    assert rig.state() == SafetyState()


def test_an_emergency_stop_latches_until_it_is_reset_and_says_why(rig):
    rig.gate.stop("a hand in the way")
    rig.wall = 1e6
    with pytest.raises(CommandRefused, match=r"a hand in the way.*reset") as refusal:
        rig.gate.require("a")
    assert refusal.value.holder == ""
    assert rig.state() == SafetyState(stopped=True, reason="a hand in the way", stops=1)
    rig.gate.reset(resume=True)
    assert rig.lets_through("a")
    assert rig.messages()[0] == "emergency stop: a hand in the way"
    assert rig.messages()[-1] == "the emergency stop was reset"


def test_a_caller_without_a_name_holds_no_lease(rig):
    with pytest.raises(CommandRefused) as refusal:
        rig.gate.acquire("", "nobody", 60.0)
    assert str(refusal.value) == "a lease is for a client that keeps a link: this call names none"
    assert rig.state().holder == ""
    assert rig.lets_through("a")


def test_a_refusal_says_what_to_do(rig):
    rig.gate.acquire("a", "Ann", 5.0)
    assert rig.refusal("b") == "the robot is held by Ann; wait until the lease is given back"
    rig.gate.stop("smoke")
    assert rig.refusal("b") == "the robot is stopped: smoke; reset the emergency stop first"
    rig.gate.lose("no answer")
    assert rig.refusal("b") == "the robot is unreachable: no answer; wait until it is found again"


def test_a_robot_that_is_lost_takes_no_command_until_it_is_found(rig):
    rig.gate.lose("no answer")
    assert not rig.lets_through("a")
    rig.gate.find()
    assert rig.lets_through("a")


def test_the_state_says_why_and_for_how_long_the_robot_is_lost(rig):
    rig.wall = 10.0
    rig.gate.lose("no answer")
    rig.wall = 12.0
    rig.gate.lose("")
    rig.wall = 15.0
    assert rig.gate.is_robot_lost
    assert rig.state() == SafetyState(lost="its server does not reach it", lostFor=5.0)
    rig.gate.find()
    assert not rig.gate.is_robot_lost
    assert rig.state() == SafetyState()


def test_a_robot_that_was_lost_while_it_was_stopped_is_stopped_again(rig):
    stopped = []
    rig.gate.on_stop(lambda: stopped.append(rig.wall))
    rig.gate.lose("no answer")
    rig.gate.find()
    assert stopped == []
    rig.gate.lose("no answer")
    rig.gate.stop("smoke")
    rig.wall = 5.0
    rig.gate.find()
    assert stopped == [0.0, 5.0]


def test_a_robot_that_was_found_is_still_stopped(rig):
    rig.gate.stop("smoke")
    rig.gate.lose("no answer")
    rig.gate.find()
    assert "stopped: smoke" in rig.refusal("a")


def test_a_refused_command_is_an_event(rig):
    rig.gate.stop("smoke")
    rig.refusal()
    expected = "refused a command: the robot is stopped: smoke"
    assert rig.newest_event() == HealthEvent(0.0, Severity.Warning, "Safety", expected)


def test_commands_that_are_refused_within_a_second_are_one_event(rig):
    rig.gate.stop("smoke")
    rig.refusal()
    rig.gate.lose("no answer")
    rig.refusal()
    assert len(rig.messages()) == 2


def test_an_emergency_stop_is_an_event(rig):
    rig.gate.stop("smoke")
    assert rig.newest_event() == HealthEvent(0.0, Severity.Error, "Safety", "emergency stop: smoke")


def test_a_reset_is_an_event(rig):
    rig.gate.stop("smoke")
    rig.gate.reset()
    assert rig.newest_event() == HealthEvent(0.0, Severity.Info, "Safety", "the emergency stop was reset")


@pytest.mark.parametrize("pause", [0.0, 1.4, 3600.0])
def test_who_commands_on_beside_a_stop_is_refused_after_the_reset_however_seldom(rig, pause):
    rig.gate.stop("smoke")
    rig.refusal("a")
    rig.wall += pause
    rig.gate.reset()
    for _ in range(3):
        rig.wall += pause
        assert not rig.lets_through("a")


def test_who_was_held_until_its_link_broke_is_refused_when_it_comes_back(rig):
    lost: set[str] = set()
    rig.gate.is_lost = lost.__contains__
    rig.gate.stop("smoke")
    rig.refusal("a")
    rig.gate.reset()
    lost.add("a")
    assert "is gone" in rig.refusal("a")
    lost.clear()
    assert "ended" in rig.refusal("a")


def test_who_commanded_nothing_beside_a_stop_but_before_is_refused_after_the_reset(rig):
    assert rig.lets_through("a")
    rig.gate.stop("smoke")
    rig.gate.reset()
    assert not rig.lets_through("a")


def test_others_may_command_meanwhile(rig):
    rig.gate.stop("smoke")
    rig.refusal("a")
    rig.refusal()
    rig.gate.reset()
    assert rig.lets_through("b")
    assert not rig.lets_through("a")
    assert not rig.lets_through()


@pytest.mark.parametrize("when", ["at the reset", "later", "always"])
def test_a_person_lets_who_commands_on_go_on(when):
    rig = Rig(resumes=when == "always")
    rig.gate.stop("smoke")
    rig.refusal("a")
    rig.gate.reset(resume=when == "at the reset")
    if when == "later":
        assert not rig.lets_through("a")
        rig.gate.reset(resume=True)
    assert rig.lets_through("a")


def test_a_person_lets_one_client_go_on_after_the_reset_and_not_before(rig):
    rig.gate.stop("smoke")
    rig.refusal("a")
    rig.refusal("b")
    rig.gate.let_go_on("a")
    rig.gate.reset()
    assert not rig.lets_through("a")
    rig.gate.let_go_on("a")
    assert rig.lets_through("a")
    assert not rig.lets_through("b")


def test_who_commands_on_is_named_with_what_to_do(rig):
    rig.gate.stop("smoke")
    rig.refusal("a")
    rig.refusal("b")
    rig.gate.reset()
    with pytest.raises(CommandRefused) as refusal:
        rig.gate.require("a")
    why = "the emergency stop ended the commands of a"
    what = "start its program again, or let all go on: nao stop --reset --resume"
    assert str(refusal.value) == f"{why}; {what}"
    assert refusal.value.holder == ""
    assert rig.newest_event() == HealthEvent(0.0, Severity.Warning, "Safety", f"refused a command: {why}")


def test_what_had_begun_is_no_command_of_its_client(rig):
    rig.gate.stop("smoke")
    with pytest.raises(CommandRefused):
        rig.gate.require("a", begun=True)
    rig.gate.reset()
    assert rig.lets_through("a")
    rig.gate.stop("smoke")
    rig.refusal("b")
    rig.gate.reset()
    rig.gate.require("b", begun=True)


def test_it_is_refused_after_a_further_stop_too(rig):
    rig.gate.stop("smoke")
    rig.refusal("a")
    rig.gate.reset()
    rig.gate.stop("fire")
    assert rig.refusal("a") == "the robot is stopped: fire; reset the emergency stop first"
    rig.gate.reset()
    assert not rig.lets_through("a")


def test_who_holds_the_robot_is_refused_as_anybody(rig):
    rig.gate.acquire("a", "Ann", 5.0)
    rig.gate.stop("smoke")
    rig.refusal("a")
    rig.gate.reset()
    assert "ended" in rig.refusal("a")


def test_what_waits_for_a_reset_is_ended_before_it(rig):
    seen = []
    rig.gate.on_reset(lambda: seen.append(rig.state().stopped))
    rig.gate.stop("smoke")
    assert seen == []
    rig.gate.reset()
    assert seen == [True]


def test_it_says_how_often_the_robot_was_stopped(rig):
    assert rig.gate.stops == 0
    rig.gate.stop("smoke")
    rig.gate.reset()
    assert rig.gate.stops == 1


@pytest.mark.parametrize("always", [False, True])
@pytest.mark.parametrize("resume", [None, False, True])
def test_behaviors_go_on_after_a_reset_when_a_person_or_the_robot_says_so(always, resume):
    gate = Rig(resumes=always).gate
    gate.stop("smoke")
    assert not gate.state().resumes
    if resume is None:
        gate.reset()
    else:
        gate.reset(resume=resume)
    assert gate.state().resumes == (always or resume is True)
    gate.stop("smoke again")
    assert not gate.state().resumes


def test_the_state_counts_the_stops_even_without_a_reset_in_between(rig):
    for count in (1, 2, 3):
        rig.gate.stop("smoke")
        assert rig.gate.state().stops == count


def test_a_reset_without_a_stop_is_none(rig):
    rig.gate.reset()
    assert rig.messages() == []


def test_the_state_says_which_server_it_is_and_whether_it_was_reset(rig):
    first, other = rig.gate.state(), Rig().gate.state()
    assert len(first.session) >= 16
    assert first.session != other.session
    assert not first.wasReset
    rig.gate.reset()
    rig.gate.stop("smoke")
    assert rig.gate.state().wasReset
    assert rig.gate.state().session == first.session


def test_who_holds_the_robot_is_an_event(rig):
    rig.gate.acquire("a", "Ann", 5.0)
    assert rig.newest_event() == HealthEvent(0.0, Severity.Info, "Safety", "Ann holds the robot")


def test_a_renewed_lease_is_no_event(rig):
    rig.gate.acquire("a", "Ann", 5.0)
    rig.wall = 2.0
    rig.gate.acquire("a", "Ann", 5.0)
    assert rig.messages() == ["Ann holds the robot"]


def test_to_give_a_lease_back_is_an_event(rig):
    rig.gate.acquire("a", "Ann", 5.0)
    rig.wall = 2.0
    rig.gate.release("a")
    assert rig.newest_event() == HealthEvent(0.0, Severity.Info, "Safety", "Ann no longer holds the robot")


def test_a_lease_that_is_taken_and_given_back_within_a_second_is_one_event(rig):
    for _ in range(3):
        rig.gate.acquire("a", "Ann", 5.0)
        rig.gate.release("a")
    assert rig.messages() == ["Ann holds the robot"]


def test_the_state_has_the_robots_time(rig):
    rig.robot_time = 7.0
    assert rig.gate.state().time == 7.0


def test_a_stop_without_a_reason_has_one_and_a_long_one_is_cut(rig):
    rig.gate.stop("")
    assert rig.gate.state().reason == "emergency stop"
    rig.gate.stop("x" * 10_000)
    assert len(rig.gate.state().reason) == 200
    rig.gate.stop("two\nlines")
    assert rig.gate.state().reason == "two lines"


@pytest.mark.parametrize("error", [OSError("no line to the motors"), SystemExit("no line to the motors")])
def test_commands_are_refused_before_anything_is_stopped_and_every_part_is_stopped(rig, caplog, error):
    seen = []

    def fails():
        seen.append(rig.lets_through())
        raise error

    rig.gate.on_stop(fails)
    rig.gate.on_stop(lambda: seen.append("stopped"))
    with pytest.raises(type(error), match="no line"):
        rig.gate.stop("now")
    assert seen == [False, "stopped"]
    assert not rig.lets_through()
    assert "Safety: emergency stop: now" in caplog.messages


def test_everything_is_stopped_before_a_log_that_may_block(rig, caplog):
    logged = []
    rig.gate.on_stop(lambda: logged.extend(caplog.messages))
    rig.gate.stop("now")
    assert logged == []
    assert caplog.messages == ["Safety: emergency stop: now"]


def test_a_part_that_could_not_be_stopped_is_logged(rig, caplog):
    def fails():
        raise OSError("no line to the motors")

    rig.gate.on_stop(fails)
    with pytest.raises(OSError, match="no line"):
        rig.gate.stop("now")
    assert "a part of the robot could not be stopped" in caplog.messages


def test_of_several_failures_to_stop_the_first_is_raised(rig):
    def fails(what):
        raise OSError(what)

    rig.gate.on_stop(lambda: fails("the first"))
    rig.gate.on_stop(lambda: fails("the second"))
    with pytest.raises(OSError, match="the first"):
        rig.gate.stop("now")


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
    assert rig.state() == SafetyState()


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
    with pytest.raises(InvalidCommand, match="seconds") as refusal:
        rig.gate.acquire("a", "Ann", seconds)
    assert refusal.value.field == "seconds"
    assert rig.lets_through("b")


def test_a_lease_may_last_a_minute(rig):
    rig.gate.acquire("a", "Ann", 60.0)
    assert rig.gate.state().remaining == 60.0


@pytest.mark.parametrize("holder", ["", "  ", "x" * 65, "a\nb"])
def test_a_holder_needs_a_name(rig, holder):
    with pytest.raises(InvalidCommand, match="holder") as refusal:
        rig.gate.acquire("a", holder, 1.0)
    assert refusal.value.field == "holder"
    assert rig.lets_through("b")


@pytest.mark.parametrize("holder", ["A", "x" * 64])
def test_a_name_has_one_character_to_64(rig, holder):
    rig.gate.acquire("a", holder, 1.0)
    assert rig.gate.state().holder == holder
