"""The robot that the page asks for: its processes are real ones that do nothing, its presence is what a test says."""

from __future__ import annotations

import asyncio
import logging
import os
import signal
import sys
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from types import ModuleType

import pytest

from codegen.messages import NO_MESSAGE
from tests.support.coroutines import Loop
from tests.support.limits import FOREVER
from tests.support.plugins import without
from tests.support.processes import children
from tests.support.pushes import Pushes
from visualhfsm._base.environment import child_environment
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._monitor.messages import PartLimits, Robot, Simulation
from visualhfsm._monitor.realm.robot import RobotPresence
from visualhfsm._processes.robots import StartedRobot, WorldFacts
from zenoh_ice import Settings

pytestmark = pytest.mark.slow

SERVER = """
import os, sys, time
print("up", *sys.argv[1:], flush=True)
if "--world=broken" in sys.argv:
    sys.exit("naoserver-sim: error: the world has no floor")
if "--world=late" not in sys.argv:
    print("ready", flush=True)
time.sleep(1000)
"""
MOVER = "import time; time.sleep(1000)"
LIMITS = PartLimits(appearance=FOREVER)
HERE = RobotPresence(present=True, simulated=True, has_balls=True, stopped="", title="Nao H25")


class Page:
    """What the page asks for, and sees."""

    def __init__(self, limits: PartLimits = LIMITS) -> None:
        self.pushes = Pushes()
        self.robot = StartedRobot(self.pushes, Settings(realm="test"), limits=limits)

    @property
    def shown(self) -> Robot:
        return self.robot.state

    async def until(self, matches: Callable[[Robot], object]) -> Robot:
        """Wait until the page is shown a robot as it is wanted."""

        def find() -> Robot | None:
            states = self.pushes.of(Robot)
            return states[-1] if states and matches(states[-1]) else None

        return await self.pushes.until(find)

    async def moved(self) -> None:
        """Wait until both balls are moved."""
        while len(children("ballmover")) != 2:
            await asyncio.sleep(0.01)

    async def appear(self, presence: RobotPresence = HERE) -> None:
        """Let the realm have a robot, whether or not it comes from here."""
        self.robot.observe(presence)
        await self.until(lambda robot: robot.status == "present")


@pytest.fixture
def stubs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Have commands that do nothing, which the children find first."""
    for name, code in (("naoserver_sim", SERVER), ("visualhfsm_naoqi", ""), ("ballmover", MOVER)):
        package = tmp_path / name
        package.mkdir()
        (package / "__init__.py").touch()
        (package / "__main__.py").write_text(code)
    (tmp_path / "visualhfsm_naoqi" / "robot.py").write_text(SERVER)
    monkeypatch.setitem(sys.modules, "visualhfsm_naoqi", ModuleType("visualhfsm_naoqi"))
    found = child_environment()
    path = os.pathsep.join((str(tmp_path), found["PYTHONPATH"]))
    monkeypatch.setattr(
        "visualhfsm._processes.robots.child_environment", lambda: found | {"PYTHONPATH": path}
    )
    worlds = [WorldFacts(name, NO_MESSAGE, balls=True) for name in ("balls", "broken", "late")]
    monkeypatch.setattr("visualhfsm._processes.robots.find_worlds", lambda: worlds)


@pytest.fixture
def limits() -> PartLimits:
    return LIMITS


@pytest.fixture
def page(stubs: None, limits: PartLimits, loop: Loop) -> Page:
    """Be the page, of which nothing is left after the test."""
    return loop.enter(asking(limits))


@asynccontextmanager
async def asking(limits: PartLimits) -> AsyncIterator[Page]:
    page = Page(limits)
    try:
        yield page
    finally:
        await page.robot.close()
        assert not [*children("naoserver_sim"), *children("visualhfsm_naoqi.robot"), *children("ballmover")]


async def test_a_robot_starts_is_there_and_ends(page: Page) -> None:
    assert page.shown == Robot()
    await page.robot.simulate(Simulation(speed="2", body="T1"))
    assert (page.shown.status, page.shown.started) == ("starting", "simulation")
    assert page.shown.simulation == Simulation(speed="2", body="T1")
    (server,) = children("naoserver_sim")
    assert {"--world=balls", "--speed=2", "--body=T1"} <= {*server.cmdline()}
    await page.appear()
    assert (page.shown.title, page.shown.simulated) == ("Nao H25", True)
    await page.robot.end()
    shown = [robot.status for robot in page.pushes.of(Robot)]
    assert [*dict.fromkeys(shown)] == ["none", "starting", "present", "stopping"]
    assert shown[-1] == "none"


async def test_what_another_window_has_asked_for_already_is_not_started_again(page: Page) -> None:
    await page.robot.simulate(Simulation())
    started = children("naoserver_sim")
    await page.robot.simulate(Simulation())
    assert children("naoserver_sim") == started
    await page.robot.simulate(Simulation(speed="5"))
    assert children("naoserver_sim") != started


@pytest.mark.parametrize(
    ("simulation", "why"),
    [
        (Simulation(world="moon"), "the simulation has no world moon"),
        (Simulation(speed="0.0"), "0.0 is not a speed"),
        (Simulation(speed="-1"), "-1 is not a speed"),
        (Simulation(body="dog"), "there is no robot dog"),
        (Simulation(world="../../etc/passwd"), "the simulation has no world"),
        (Simulation(speed="--help"), "--help is not a speed"),
        (Simulation(body="../robots/arm.toml"), "there is no robot"),
        (Simulation(body="--help"), "there is no robot --help"),
    ],
)
async def test_what_cannot_be_simulated_is_refused_and_changes_nothing(
    simulation: Simulation, why: str, page: Page
) -> None:
    await page.robot.simulate(Simulation())
    with pytest.raises(VisualHfsmError, match=why):
        await page.robot.simulate(simulation)
    assert page.shown.simulation.world == "balls"
    assert len(children("naoserver_sim")) == 1


async def test_a_robot_of_somebody_else_is_neither_replaced_nor_ended_nor_shown_as_ours(page: Page) -> None:
    await page.appear()
    with pytest.raises(VisualHfsmError, match="there is already a robot that was not started here"):
        await page.robot.simulate(Simulation(body="T1"))
    with pytest.raises(VisualHfsmError, match="this robot was not started here"):
        await page.robot.end()
    assert (page.shown.started, page.shown.simulation) == ("", Simulation())
    assert page.shown.status == "present"


async def test_a_simulation_that_ends_by_itself_says_why_in_its_words(page: Page) -> None:
    await page.robot.simulate(Simulation(world="broken"))
    robot = await page.until(lambda robot: robot.trouble)
    assert robot.trouble == "The simulation could not be started: the world has no floor"
    assert (robot.status, robot.started) == ("none", "")


async def test_a_server_that_is_killed_is_lost_until_another_one_starts(
    caplog: pytest.LogCaptureFixture, page: Page
) -> None:
    caplog.set_level(logging.INFO)
    await page.robot.simulate(Simulation())
    while "ready" not in caplog.messages:
        await asyncio.sleep(0.01)
    await page.appear()
    children("naoserver_sim")[0].send_signal(signal.SIGKILL)
    robot = await page.until(lambda robot: robot.trouble)
    assert robot.trouble == "The simulation has ended: it was terminated by SIGKILL"
    page.robot.observe(RobotPresence())
    lost = page.shown
    assert (lost.status, lost.since > 0.0) == ("lost", True)
    await page.robot.simulate(Simulation())
    assert (page.shown.status, page.shown.since, page.shown.trouble) == ("starting", 0.0, NO_MESSAGE)


@pytest.mark.parametrize("limits", [PartLimits(appearance=0.0)])
async def test_a_server_that_is_ready_and_not_seen_says_who_may_not_serve(page: Page) -> None:
    await page.robot.simulate(Simulation())
    robot = await page.until(lambda robot: robot.trouble)
    assert "the router may not let this user serve a robot" in str(robot.trouble)
    assert robot.status == "starting"


async def test_the_last_sight_of_a_robot_that_was_ended_here_brings_it_not_back(page: Page) -> None:
    await page.robot.simulate(Simulation())
    await page.appear()
    await page.robot.end()
    page.robot.observe(HERE)
    before = page.shown.status
    page.robot.observe(RobotPresence())
    page.robot.observe(HERE)
    assert (before, page.shown.status) == ("none", "present")


async def test_a_robot_is_there_once_it_says_whether_it_is_stopped(page: Page) -> None:
    await page.robot.simulate(Simulation())
    page.robot.observe(HERE._replace(stopped=None))
    assert page.shown.status == "starting"
    await page.appear(HERE._replace(stopped="a hand"))
    assert page.shown.stopped == "a hand"


class TestRealRobots:
    @pytest.mark.parametrize(
        ("address", "start", "options"),
        [
            ("nao.local", "stand", {"--robot=tcp://nao.local", "--start=stand", "--end=rest"}),
            (
                "tcps://10.0.0.7:9503",
                "leave",
                {"--robot=tcps://10.0.0.7:9503", "--start=leave", "--end=leave"},
            ),
        ],
    )
    async def test_one_is_connected_by_its_address_and_crouches_if_it_stood_up(
        self, address: str, start: str, options: set[str], page: Page
    ) -> None:
        await page.robot.connect(address, start, lambda: None)
        assert (page.shown.started, page.shown.name) == ("real", address)
        (server,) = children("visualhfsm_naoqi.robot")
        assert options <= {*server.cmdline()}

    @pytest.mark.parametrize(
        "address",
        [
            "",
            "nao.local; reboot",
            "nao.local --end=limp",
            "-x",
            "ftp://nao.local",
            "http://nao.local",
            "a" * 300,
        ],
    )
    async def test_what_is_no_address_is_refused(self, address: str, page: Page) -> None:
        with pytest.raises(VisualHfsmError, match="is not a robot address"):
            await page.robot.connect(address, "stand", lambda: None)

    async def test_without_the_plug_in_the_page_is_told_what_installs_it(self, page: Page) -> None:
        with (
            without("visualhfsm_naoqi"),
            pytest.raises(VisualHfsmError, match=r"pip install 'visualhfsm\[naoqi\]'"),
        ):
            await page.robot.connect("nao.local", "leave", lambda: None)
        assert page.shown == Robot()

    async def test_nothing_may_start_while_one_is_connected_and_none_is_while_something_runs(
        self, page: Page
    ) -> None:
        page.robot.require_connected()
        await page.robot.connect("nao.local", "stand", lambda: None)
        with pytest.raises(VisualHfsmError, match=r"nao\.local is being connected"):
            page.robot.require_connected()
        await page.appear()
        page.robot.require_connected()

        def refuse() -> None:
            assert not children("visualhfsm_naoqi.robot"), "the one before has ended"
            raise VisualHfsmError.because("stop walker first")

        with pytest.raises(VisualHfsmError, match="stop walker first"):
            await page.robot.connect("other.local", "stand", refuse)
        assert (page.shown.started, page.shown.name, page.shown.status) == ("", "", "none")


class TestBalls:
    async def test_they_are_moved_once_the_simulation_is_ready_and_rest_when_that_is_asked(
        self, page: Page
    ) -> None:
        await page.robot.simulate(Simulation(world="balls", balls=True))
        await page.appear()
        await page.moved()
        assert page.shown.simulation.balls
        await page.robot.move_balls(moving=False)
        assert (page.shown.simulation.balls, children("ballmover")) == (False, [])
        await page.robot.move_balls(moving=True)
        await page.moved()

    async def test_they_rest_when_what_moves_them_has_ended(self, page: Page) -> None:
        await page.robot.simulate(Simulation(world="balls", balls=True))
        await page.appear()
        await page.moved()
        for mover in children("ballmover"):
            mover.kill()
        assert not (await page.until(lambda robot: not robot.simulation.balls)).simulation.balls

    async def test_the_next_simulation_moves_them_again_if_the_first_has_ended_with_them(
        self, page: Page
    ) -> None:
        await page.robot.simulate(Simulation(world="balls", balls=True))
        await page.moved()
        children("naoserver_sim")[0].kill()
        robot = await page.until(lambda robot: robot.trouble)
        assert robot.simulation.balls
        while children("ballmover"):
            await asyncio.sleep(0.01)
        assert page.shown.simulation.balls

    async def test_a_robot_without_any_moves_none(self, page: Page) -> None:
        await page.appear(HERE._replace(has_balls=False))
        with pytest.raises(VisualHfsmError, match="no balls that can be moved"):
            await page.robot.move_balls(moving=True)


async def test_all_processes_end_with_the_page(page: Page) -> None:
    await page.robot.simulate(Simulation(world="balls", balls=True))
    await page.moved()
