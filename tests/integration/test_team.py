"""A team over the network: servers of separate processes hear each other, and what strangers send harms nobody."""

from __future__ import annotations

from interfaces.nao import HealthPrx, Teammate
from naoserver.serving.medium import REPORT, StreamMedium
from tests.support.limits import START_LIMIT
from tests.support.served_teams import team, until_holder
from tests.support.waiting import until


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
