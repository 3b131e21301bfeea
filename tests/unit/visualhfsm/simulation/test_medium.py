"""Robots of a team in virtual time: their messages are delayed and lost by a seed, and a stop hands a role over."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack

import pytest

from hfsm_runtime.virtual.clock import TaskClock
from hfsm_runtime.virtual.network import VirtualNetwork
from interfaces.nao import SafetyPrx, TeamPrx
from naoserver.serving.medium import Membership
from visualhfsm.simulation import RobotUnderTest
from visualhfsm.simulation._medium import NOISY_DELAY, NOISY_LOSS, VirtualMedium


def heard(seed: int, sent: int = 1000) -> list[tuple[int, float]]:
    """Return the numbers of the messages that arrive over a noisy medium, each with its delay."""
    clock, arrived = TaskClock(), list[tuple[int, float]]()
    air = VirtualMedium.noisy(seed)
    medium = air.at(clock)
    medium.subscribe("red", lambda m: arrived.append((int(m), clock.now() - int(m))))
    air.at(clock).subscribe("blue", lambda _: pytest.fail("another team hears it"))
    for number in range(sent):
        medium.send("red", str(number).encode())
        clock.advance(1.0)
    return arrived


def test_a_share_of_the_messages_is_lost_and_the_others_are_late():
    arrived = heard(seed=1)
    assert 1.0 - len(arrived) / 1000 == pytest.approx(NOISY_LOSS, abs=0.03)
    delays = [delay for _, delay in arrived]
    assert NOISY_DELAY[0] - 1e-6 <= min(delays) < max(delays) <= NOISY_DELAY[1] + 1e-6


def test_the_same_seed_loses_the_same_messages():
    assert heard(seed=1, sent=100) == heard(seed=1, sent=100) != heard(seed=2, sent=100)


def test_who_no_longer_listens_hears_nothing():
    clock = TaskClock()
    medium = VirtualMedium(delay=(1.0, 1.0)).at(clock)
    listening = medium.subscribe("red", lambda _: pytest.fail("it was closed"))
    medium.send("red", b"")
    listening.close()
    clock.advance(2.0)


class Robots:
    """Two whole robots of a team, on one clock."""

    def __init__(self, steps: ExitStack) -> None:
        self.clock = TaskClock()
        medium = VirtualMedium.noisy(1)
        self.networks = {}
        for number, name in enumerate(("nao", "nao2")):
            network = self.networks[name] = VirtualNetwork(self.clock, kept=0)
            steps.callback(network.communicator.destroy)
            member = Membership(name, "red", medium.at(self.clock), session=number)
            steps.callback(RobotUnderTest("fake", self.clock, network, member=member).close)

    def until_striker(self, costs: dict[str, float], wanted: list[str], limit: float) -> None:
        """Let each claim the role ten times a second, until those have it who are to."""
        end, striking = self.clock.now() + limit, list[str]()
        while self.clock.now() < end:
            self.clock.advance(0.1)
            striking = [name for name, cost in costs.items() if self.team(name).claim("striker", cost)]
            if striking == wanted:
                return
        raise AssertionError(f"{striking} after {limit} s")

    def team(self, name: str) -> TeamPrx:
        return TeamPrx.checkedCast(self.networks[name].communicator.stringToProxy("Team"))

    def safety(self, name: str) -> SafetyPrx:
        return SafetyPrx.checkedCast(self.networks[name].communicator.stringToProxy("Safety"))


@pytest.fixture
def robots() -> Iterator[Robots]:
    with ExitStack() as steps:
        yield Robots(steps)


def test_a_stopped_robot_hands_its_role_over_within_a_second_and_gets_it_back_after_the_reset(robots):
    costs = {"nao": 1.0, "nao2": 2.0}
    robots.until_striker(costs, ["nao"], 2.0)
    robots.safety("nao").emergencyStop("a test")
    robots.until_striker(costs, ["nao2"], 1.0)
    robots.safety("nao").resetEmergencyStop()
    robots.until_striker(costs, ["nao"], 2.0)


def test_robots_hear_where_their_mates_are(robots):
    robots.team("nao").reportPlace(1.0, 2.0, 0.5)
    robots.clock.advance(1.0)
    (mate,) = robots.team("nao2").getTeamState().mates
    assert (mate.name, mate.x, mate.y, mate.heading) == ("nao", 1.0, 2.0, 0.5)
    assert mate.age < 0.5
