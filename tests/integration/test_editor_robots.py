"""Start, watch and end robots from the editor: real processes, a real simulation."""

from __future__ import annotations

import asyncio
import signal
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from naoserver.fake import FakeRobot
from tests.support.arm import ARM, ARM_TOML
from tests.support.editor import DOCUMENT, Refused, Window, editor
from tests.support.limits import CALL_LIMIT, RUN_LIMIT, START_LIMIT
from tests.support.plugins import OWN_ROBOTS, needs
from tests.support.processes import children, free_endpoint
from tests.support.pushes import Pushes
from tests.support.robot_server import served
from tests.support.security import Keys, routing
from visualhfsm._editor.parts import Parts, make_parts
from visualhfsm._monitor.messages import USUAL_LIMITS, PartLimits, Robot, Simulation
from visualhfsm._processes.robots import find_worlds
from zenoh_ice import Settings


class Page:
    """What the page sees of the robot, and can request."""

    def __init__(self, parts: Parts, pushes: Pushes) -> None:
        self.followers = parts.followers
        self.robot = parts.robot
        self.pushes = pushes

    async def until(self, matches: Callable[[Robot], object]) -> Robot:
        """Wait until the robot is as it is wanted."""

        def find() -> Robot | None:
            states = self.pushes.of(Robot)
            return states[-1] if states and matches(states[-1]) else None

        return await self.pushes.until(find)

    async def balls_are_moved(self) -> None:
        """Wait for the processes that move the balls; the page shows them only as balls that may move."""
        await self.until(lambda robot: robot.has_balls)
        async with asyncio.timeout(START_LIMIT):
            while len(children("ballmover")) != 2:
                await asyncio.sleep(0.02)


def opened(
    go: Callable[[Page], Awaitable[object]],
    realm: str = "test-robots",
    endpoint: str = "",
    settings: Settings | None = None,
    folder: Path | None = None,
    *,
    limits: PartLimits = USUAL_LIMITS,
) -> None:
    """Do something as a page in a realm without a robot, or in that of one at an `endpoint`."""
    connect = (endpoint or free_endpoint(),)
    chosen = settings or Settings(realm=realm, connect=connect, clock="wall", timeout=CALL_LIMIT)

    async def run() -> None:
        pushes = Pushes()
        parts = make_parts(chosen, folder=folder, limits=limits)(pushes)
        try:
            async with asyncio.timeout(RUN_LIMIT):
                await go(Page(parts, pushes))
        finally:
            for service in (parts.started, parts.robot, parts.followers):
                await service.close()

    asyncio.run(run())
    assert not children("naoserver_sim")
    assert not children("ballmover")


def test_a_simulation_is_started_with_moving_balls_killed_started_again_and_ended(
    caplog: pytest.LogCaptureFixture,
) -> None:
    async def go(page: Page) -> None:
        assert page.robot.state.status == "none"
        await page.robot.simulate(Simulation(speed="2", balls=True, body="H21"))
        await page.until(lambda robot: robot.status == "starting" and robot.started == "simulation")
        (simulation,) = children("naoserver_sim")
        assert {"--world=balls", "--speed=2", "--body=H21"} <= {*simulation.cmdline()}
        await page.robot.simulate(Simulation(speed="2", balls=True, body="H21"))  # from another window
        robot = await page.until(lambda robot: robot.status == "present" and robot.simulated and robot.speed)
        assert robot.simulation == Simulation(speed="2", balls=True, body="H21")
        assert (await page.until(lambda robot: robot.title)).title == "Nao H21"
        assert children("naoserver_sim") == [simulation]
        await page.balls_are_moved()
        await page.followers.stand_robot()
        await page.robot.move_balls(moving=False)
        assert not children("ballmover")
        assert "lost" not in [robot.status for robot in page.pushes.of(Robot)]

        simulation.send_signal(signal.SIGKILL)
        lost = await page.until(lambda robot: robot.status == "lost" and robot.trouble)
        assert lost.since > 0
        assert lost.trouble == "The simulation has ended: it was terminated by SIGKILL"
        assert lost.started == ""
        await page.robot.simulate(Simulation(world="empty"))
        again = await page.until(lambda robot: robot.status == "present")
        assert (again.since, again.trouble) == (0.0, "")

        before = len(page.pushes.of(Robot))
        await page.robot.end()
        robot = await page.until(lambda robot: robot.status == "none")
        assert robot.started == ""
        assert "lost" not in [robot.status for robot in page.pushes.of(Robot)[before:]]

    opened(go)
    warnings = [record.message for record in caplog.records if record.levelname == "WARNING"]
    assert warnings == ["the robot is lost; it may come back"]


def test_a_client_of_a_router_starts_a_simulation_with_moving_balls_and_ends_it() -> None:
    async def go(page: Page) -> None:
        await page.robot.simulate(Simulation(balls=True))
        await page.until(lambda robot: robot.status == "present" and robot.simulated and robot.speed)
        await page.balls_are_moved()
        await page.followers.emergency_stop()
        await page.until(lambda robot: robot.stopped)
        await page.robot.end()
        assert (await page.until(lambda robot: robot.status == "none")).trouble == ""

    endpoint = free_endpoint()
    client = Settings(
        realm="test-client", mode="client", connect=(endpoint,), clock="wall", timeout=CALL_LIMIT
    )
    with routing(Settings(mode="router", listen=(endpoint,))):
        opened(go, settings=client)


def test_a_robot_that_a_user_of_the_router_may_not_serve_is_reported(tmp_path: Path) -> None:
    async def go(page: Page) -> None:
        await page.robot.simulate(Simulation(world="empty"))
        robot = await page.until(lambda robot: robot.trouble)
        assert robot.status == "starting"
        assert "the router may not let this user serve a robot" in robot.trouble
        await page.robot.end()
        assert (await page.until(lambda robot: robot.status == "none")).trouble == ""

    keys = Keys(tmp_path / "keys")
    with routing(keys.settings("router")):
        opened(go, settings=keys.settings("operator", timeout=CALL_LIMIT), limits=PartLimits(appearance=0.2))


@pytest.fixture
def endless(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A connection to a real robot that comes to no end."""
    (tmp_path / "qi.py").write_text("import time\ntime.sleep(3600)\n")
    monkeypatch.syspath_prepend(str(tmp_path))


@contextmanager
def window_of(root: Path, *names: str) -> Iterator[Window]:
    """A window of an editor that runs components, with documents of these names."""
    root.mkdir()
    files = [root / f"{name}.xml" for name in names]
    for file in files:
        file.write_text(DOCUMENT)
    settings = Settings(realm="test-starts", connect=(free_endpoint(),), clock="wall", timeout=CALL_LIMIT)
    with (
        editor(root, *files, make_parts=make_parts(settings, folder=root)) as running,
        running.window() as window,
    ):
        yield window


def test_stop_says_that_what_was_starting_has_ended(tmp_path: Path) -> None:
    with window_of(tmp_path / "root", "first") as window:
        window.send("start", tab=1, arguments=[])
        window.wait_for_push("started", status="generating")
        assert window.ask("emergencyStop") == {"stopped": ["first"], "failed": {}}


@needs("visualhfsm_naoqi")
@pytest.mark.usefixtures("endless")
def test_nothing_is_run_while_a_real_robot_is_connected_and_none_is_connected_while_something_starts(
    tmp_path: Path,
) -> None:
    with window_of(tmp_path / "root", "first", "second") as window:
        first, second = (each["tab"] for each in window.workspace["tabs"])
        window.ask("start", tab=second, arguments=[], dryRun=True, body="H25")
        window.ask("connectRobot", address="127.0.0.1:1")
        with pytest.raises(Refused, match=r"127\.0\.0\.1:1 is being connected"):
            window.ask("start", tab=first, arguments=[])
        window.ask("endRobot")

        starting = window.send("start", tab=first, arguments=[])
        window.wait_for_push("started", tab=first, status="generating")
        with pytest.raises(Refused, match="stop first first: it would drive the real robot at once"):
            window.ask("connectRobot", address="127.0.0.1:1")
        window.answer(starting)
        with pytest.raises(Refused, match="stop first first"):
            window.ask("connectRobot", address="127.0.0.1:1")


def test_of_different_robots_that_windows_ask_for_at_once_one_runs_and_ends() -> None:
    async def go(page: Page) -> None:
        async def ask(delay: float, speed: str) -> None:
            await asyncio.sleep(delay)
            await page.robot.simulate(Simulation(speed=speed))

        for apart in (0.0, 0.01, 0.1):
            await asyncio.gather(*(ask(number * apart, f"{number + 1}") for number in range(3)))
            (simulation,) = children("naoserver_sim")
            assert f"--speed={page.robot.state.simulation.speed}" in simulation.cmdline()
        await page.robot.end()
        assert not children("naoserver_sim")

    opened(go)


def test_a_real_robot_that_its_server_does_not_reach_is_lost_until_it_answers() -> None:
    with served(FakeRobot()) as robot:

        async def go(page: Page) -> None:
            found = await page.until(lambda robot: robot.status == "present" and robot.speed)
            assert not found.simulated
            robot.assembly.gate.lose("the cable is out")
            assert (await page.until(lambda robot: robot.status == "lost")).since > 0
            robot.assembly.gate.find()
            assert (await page.until(lambda robot: robot.status == "present")).since == 0

        opened(go, robot.realm, robot.endpoint)


def test_a_missing_package_is_reported_with_the_command_that_installs_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "mujoco.py").write_text("raise ModuleNotFoundError('gone', name='mujoco')\n")
    monkeypatch.syspath_prepend(str(tmp_path))

    async def go(page: Page) -> None:
        await page.robot.simulate(Simulation())
        robot = await page.until(lambda robot: robot.trouble)
        assert robot.status == "none"
        expected = "mujoco is not installed; type: pip install 'visualhfsm[sim]'"
        assert robot.trouble == f"The simulation could not be started: {expected}"

    opened(go)


@OWN_ROBOTS
@pytest.mark.sim
def test_a_robot_of_the_project_is_simulated_and_a_faulty_file_is_said_with_its_line(tmp_path: Path) -> None:
    robots = tmp_path / "robots"
    robots.mkdir()
    (robots / "arm.toml").write_text(ARM_TOML)
    (robots / "arm.urdf").write_text(ARM)
    (robots / "faulty.toml").write_text('model = "arm.urdf"\nmounted = 7\n')

    async def go(page: Page) -> None:
        await page.robot.simulate(Simulation(world="empty", body="robots/faulty.toml"))
        trouble = (await page.until(lambda robot: robot.trouble)).trouble
        assert "The simulation could not be started: " in trouble
        assert f"{robots}/faulty.toml:2" in trouble
        await page.robot.simulate(Simulation(world="empty", body="robots/arm.toml"))
        robot = await page.until(lambda robot: robot.status == "present" and robot.title == "An arm")
        assert robot.simulation.body == "robots/arm.toml"

    opened(go, folder=tmp_path)


@needs("visualhfsm_naoqi")
def test_a_real_robot_that_is_not_there_says_so() -> None:
    async def go(page: Page) -> None:
        await page.robot.connect("127.0.0.1:1", "leave", lambda: None)
        robot = await page.until(lambda robot: robot.status == "starting")
        assert (robot.started, robot.name) == ("real", "127.0.0.1:1")
        robot = await page.until(lambda robot: robot.trouble)
        assert robot.trouble.startswith("The connection to 127.0.0.1:1 could not be started: ")

    opened(go)


def test_the_worlds_are_those_of_the_simulation() -> None:
    worlds = {world.name: world for world in find_worlds()}
    assert all(isinstance(world.description.to_data(), dict) for world in worlds.values()), (
        "known by templates"
    )
    assert set(worlds) == {"balls", "empty", "league", "match", "room", "soccer"}
    assert [name for name, world in worlds.items() if world.balls] == ["balls"]
    assert all(world.description for world in worlds.values())


def test_the_first_window_is_asked_for_a_demo_unless_a_document_is_open(tmp_path: Path) -> None:
    root = tmp_path / "root"
    root.mkdir()
    (root / "robot.xml").write_text(DOCUMENT)
    with editor(root, demo=True) as running, running.socket() as socket:
        window = Window(socket)
        assert [window.ask("hello")["demo"] for _ in range(2)] == [True, False]
    with editor(root, root / "robot.xml", demo=True) as running, running.socket() as socket:
        assert Window(socket).ask("hello")["demo"] is False
