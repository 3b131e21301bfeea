"""What a robot reports its team and hears from it, also from mates that lie, fall silent or have other clocks."""

from __future__ import annotations

import math
from collections.abc import Iterator

import msgspec
import pytest

from hfsm_runtime.virtual.clock import TaskClock
from interfaces.jderobot import InvalidValueException
from interfaces.nao import RoleClaim, Teammate
from tests.support.teams import STEP, Player, current
from visualhfsm.simulation._medium import VirtualMedium

INF = math.inf


class Pair:
    """Two robots of a team without noise; the clock of the second is a day ahead."""

    def __init__(self) -> None:
        self.clock = TaskClock()
        air = VirtualMedium()
        self.medium = air.at(self.clock)
        self.a = Player(self.clock, air.at(self.clock), "a")
        self.b = Player(self.clock, air.at(self.clock), "b", ahead=86_400.0)

    def live(self, seconds: float) -> None:
        for _ in range(round(seconds / STEP)):
            self.clock.advance(STEP)
            self.a.live()
            self.b.live()

    def send(self, **reported: object) -> None:
        """Send what a mate `m` reports, with some members changed."""
        valid = Teammate(name="m", session=1, time=self.clock.now(), ready=True, placeAge=INF, ballAge=INF)
        mate = msgspec.structs.replace(valid, **reported)
        self.medium.send("red", msgspec.msgpack.encode({"returnValue": mate}))
        self.clock.advance(STEP)


@pytest.fixture
def pair() -> Iterator[Pair]:
    made = Pair()
    yield made
    for player in (made.a, made.b):
        if player.is_there:
            player.team.close()


def test_a_mate_hears_what_a_robot_tells_and_how_old_it_is_by_its_own_clock(pair):
    pair.a.team.reportPlace(1.5, -0.5, 0.25 + math.tau, current())
    pair.a.team.reportDoing("looks for the ball", current())
    pair.live(0.3)
    pair.a.team.reportBall(2.0, 0.5, current())
    pair.live(0.5)
    (heard,) = pair.b.mates().values()
    assert (heard.name, heard.doing, heard.ready) == ("a", "looks for the ball", True)
    assert (heard.x, heard.y, heard.heading) == pytest.approx((1.5, -0.5, 0.25))
    assert (heard.ballX, heard.ballY) == (2.0, 0.5)
    assert heard.age < 0.25
    assert (heard.placeAge, heard.ballAge) == pytest.approx((0.8, 0.5), abs=2 * STEP)


def test_what_was_never_told_is_infinitely_old(pair):
    pair.live(0.5)
    (heard,) = pair.b.mates().values()
    assert (heard.placeAge, heard.ballAge, heard.doing) == (INF, INF, "")


def test_a_mate_that_dies_grows_old_and_is_forgotten(pair):
    pair.live(0.5)
    pair.a.vanish()
    pair.live(5.0)
    assert pair.b.mates()["a"].age == pytest.approx(5.0, abs=0.25)
    pair.live(5.1)
    assert not pair.b.mates()


def test_a_mate_that_ends_says_so(pair):
    pair.live(0.5)
    pair.a.team.close()
    pair.clock.advance(STEP)
    assert not pair.b.mates()["a"].ready


# -- roles ---------------------------------------------------------------------------------------------------


def until_held(pair: Pair, role: str, limit: float = 2.0) -> tuple[str, float]:
    """Return who has a role, and after how many seconds."""
    begin = pair.clock.now()
    while pair.clock.now() - begin < limit:
        for player in (pair.a, pair.b):
            if role in player.held:
                return player.name, pair.clock.now() - begin
        pair.live(STEP)
    raise AssertionError(f"nobody has the role {role} after {limit} s")


def test_the_one_with_the_lowest_cost_has_a_role_and_both_know_it(pair):
    pair.a.costs["striker"], pair.b.costs["striker"] = 2.0, 1.0
    assert until_held(pair, "striker")[0] == "b"
    pair.live(1.0)
    assert (pair.a.held, pair.b.held) == (set(), {"striker"})
    assert {player.team.getRobotOf("striker", current()) for player in (pair.a, pair.b)} == {"b"}


def test_a_role_goes_over_when_another_one_is_better_by_a_fifth_only(pair):
    pair.a.costs["striker"], pair.b.costs["striker"] = 1.0, 2.0
    until_held(pair, "striker")
    pair.b.costs["striker"] = 0.85
    pair.live(2.0)
    assert pair.a.held == {"striker"}
    pair.b.costs["striker"] = 0.75
    pair.live(1.0)
    assert (pair.a.held, pair.b.held) == (set(), {"striker"})


@pytest.mark.parametrize("how", ["falls", "vanishes", "releases", "leaves the state"])
def test_a_role_goes_over_within_a_second(pair, how):
    pair.a.costs["striker"], pair.b.costs["striker"] = 1.0, 2.0
    assert until_held(pair, "striker")[0] == "a"
    pair.live(1.0)
    if how == "falls":
        pair.a.is_ready = False
    elif how == "vanishes":
        pair.a.vanish()
    else:
        pair.a.costs.clear()
        pair.a.held.clear()
    if how == "releases":
        pair.a.team.release("striker", current())
    limit = 1.25 if how == "leaves the state" else 1.0  # a claim lasts a second
    pair.live(0.1)  # its component knows it by then
    assert until_held(pair, "striker", limit - 0.1)[0] == "b"


def test_a_lost_client_gives_its_roles_back(pair):
    pair.a.costs["striker"] = 1.0
    until_held(pair, "striker")
    pair.a.team.drop_client("another")
    assert pair.a.team.getRobotOf("striker", current()) == "a"
    pair.a.team.drop_client(current().client)
    assert pair.a.team.getRobotOf("striker", current()) == ""


def test_a_robot_alone_has_each_role_that_it_claims_at_once_unless_it_has_fallen():
    alone = Player(TaskClock(), None, "a")
    assert alone.team.claim("striker", 1.0, current())
    assert alone.team.getRobotOf("striker", current()) == "a"
    alone.is_ready = False
    assert not alone.team.claim("striker", 1.0, current())
    assert alone.team.getRobotOf("striker", current()) == ""


def test_a_robot_has_eight_roles_at_most(pair):
    for number in range(8):
        pair.a.team.claim(f"role {number}", 1.0, current())
    with pytest.raises(InvalidValueException, match="at most 8 roles"):
        pair.a.team.claim("one more", 1.0, current())
    pair.a.team.release(None, current())
    pair.a.team.claim("one more", 1.0, current())


# -- hostile -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("reported", "why"),
    [
        ({"x": 1e300}, "a place that cannot be"),
        ({"ballY": math.nan}, "a place that cannot be"),
        ({"placeAge": -1.0}, "a place that cannot be"),
        ({"ballAge": math.nan}, "a place that cannot be"),
        ({"heading": INF}, "not finite"),
        ({"time": math.nan}, "not finite"),
        ({"claims": [RoleClaim("striker", -INF, True)]}, "not finite"),
        ({"claims": [RoleClaim("striker", 0.0, True)] * 9}, "claims a role"),
        ({"claims": [RoleClaim("\x1b[2J", 0.0, True)]}, "claims a role"),
        ({"doing": "x" * 65}, "what it does"),
        ({"doing": "\x1b[2J"}, "what it does"),
        ({"name": ""}, "no name"),
        ({"name": "m\n"}, "no name"),
        ({"name": "a", "session": 99}, "called a"),
        ({"name": 7}, "name is str, not int"),
        ({"x": "far"}, "x is float, not str"),
    ],
)
def test_what_cannot_be_is_ignored_and_reported(pair, reported, why):
    pair.send(**reported)
    assert not pair.a.mates()
    assert len(pair.a.reports()) == 1
    assert why in pair.a.reports()[0]


@pytest.mark.parametrize("message", [b"", b"\xc1", b"\x93" * 100_000, b"x" * 5000, bytes(4096)])
def test_bytes_that_are_no_message_are_ignored(pair, message):
    pair.a.team.hear(message)
    assert not pair.a.mates()
    assert len(pair.a.reports()) == 1


def test_many_names_fill_the_team_and_push_nobody_out(pair):
    pair.live(0.5)
    for number in range(500):
        pair.send(name=f"m{number}")
        pair.a.live()
        pair.b.live()
    assert 10 <= len(pair.a.mates()) <= 15
    assert "b" in pair.a.mates()
    assert any("the team is full" in each for each in pair.a.reports())


def test_a_message_that_was_overtaken_changes_nothing(pair):
    pair.clock.advance(5.0)
    pair.send(time=4.0, doing="second")
    pair.send(time=3.9, doing="first")
    assert pair.a.mates()["m"].doing == "second"


def test_a_server_that_began_again_is_heard_when_the_former_one_is_old(pair):
    pair.clock.advance(5.0)
    pair.send(session=1, doing="before")
    pair.send(session=2, time=0.1, doing="after")
    assert pair.a.mates()["m"].doing == "before"
    pair.clock.advance(0.7)
    pair.send(session=2, time=0.8, doing="after")
    assert pair.a.mates()["m"].doing == "after"


@pytest.mark.parametrize(
    ("call", "field"),
    [
        (lambda team: team.reportPlace(math.nan, 0.0, 0.0, current()), "x"),
        (lambda team: team.reportPlace(0.0, 0.0, INF, current()), "heading"),
        (lambda team: team.reportBall(0.0, 1e9, current()), "y"),
        (lambda team: team.reportDoing("x" * 65, current()), "doing"),
        (lambda team: team.claim("", 1.0, current()), "role"),
        (lambda team: team.claim("striker\n", 1.0, current()), "role"),
        (lambda team: team.claim("striker", math.nan, current()), "cost"),
    ],
)
def test_a_component_cannot_tell_what_cannot_be(pair, call, field):
    with pytest.raises(InvalidValueException) as refusal:
        call(pair.a.team)
    assert refusal.value.field == field
