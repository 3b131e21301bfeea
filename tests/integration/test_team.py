"""A team over the network: servers of separate processes hear each other, and what strangers send harms nobody."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import NamedTuple

from interfaces.nao import HealthPrx, Teammate, TeamPrx
from naoserver.serving.medium import REPORT, StreamMedium
from tests.support.limits import MOVE_LIMIT, START_LIMIT
from tests.support.processes import ComponentProcess, free_endpoint, module
from tests.support.waiting import until
from zenoh_ice import Communicator, initialize


class Robot(NamedTuple):
    """A robot of a process of its own, as a component knows it."""

    process: ComponentProcess
    communicator: Communicator

    @property
    def team(self) -> TeamPrx:
        return TeamPrx.checkedCast(self.communicator.stringToProxy("Team"))


@contextmanager
def team(*realms: str) -> Iterator[list[Robot]]:
    """Serve robots of one team, each in a process; all connect to the first."""
    first = free_endpoint()
    with ExitStack() as steps:
        robots = []
        for realm in realms:
            endpoint = first if realm == realms[0] else free_endpoint()
            options = ["--team", "red", "--realm", realm, "--listen", endpoint]
            options += [] if endpoint == first else ["--connect", first]
            process = steps.enter_context(ComponentProcess(module("naoserver.fake", *options)))
            process.wait_for(f"ready: realm {realm}")
            client = steps.enter_context(initialize(realm=realm, connect=[endpoint], listen=[]))
            robots.append(Robot(process, client))
        yield robots


def holders(robots: list[Robot], costs: list[float]) -> list[str]:
    """Let each claim the role of the striker once; return who has it."""
    return [
        robot.communicator.realm
        for robot, cost in zip(robots, costs, strict=True)
        if robot.team.claim("striker", cost)
    ]


def until_holder(robots: list[Robot], costs: list[float], name: str) -> None:
    """Claim, as components do in each of their cycles, until one robot alone has the role."""
    until(lambda: holders(robots, costs) == [name], MOVE_LIMIT, step=0.05)


def test_a_flood_of_strangers_hides_no_mate_and_delays_no_call():
    with team("nao", "nao2") as robots:
        first, second = robots
        until(lambda: [m.name for m in second.team.getTeamState().mates] == ["nao"], START_LIMIT)
        stranger = StreamMedium(first.communicator.transport)
        for number in range(20_000):
            lie = Teammate(name=f"m{number}", session=1, x=1e300 * (number % 2))
            valid = bytes(REPORT.result.gather_result(lie, "a lie"))
            stranger.send("red", (valid, bytes(5000), b"\xc1" * 9)[number % 3])
        stranger.close()
        health = HealthPrx.checkedCast(second.communicator.stringToProxy("Health"))
        until(lambda: any("ignored a message" in event.message for event in health.getHealth().events))
        names = [mate.name for mate in second.team.getTeamState().mates]
        assert "nao" in names
        assert len(names) <= 15
        until_holder(robots, [1.0, 2.0], "nao")
