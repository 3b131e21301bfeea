"""A team over the network: fake robots in processes of their own, which connect to the first of them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import NamedTuple

from interfaces.nao import TeamPrx
from tests.support.limits import MOVE_LIMIT
from tests.support.processes import ComponentProcess, free_endpoint, module
from tests.support.waiting import until
from zenoh_ice import Communicator, initialize

__all__ = ["Robot", "team", "until_holder"]


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
