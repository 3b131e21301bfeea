"""Start and end the robot that the page asks for, and say which robot the realm has.

The editor runs a robot's server as a child process, and those that move the balls of a simulation: they end
with it. A robot that somebody else serves is only reported; nothing here ends it.
"""

from __future__ import annotations

import asyncio
import logging
import re
import sys
import time
import tomllib
from collections.abc import Callable, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Final, Literal

import msgspec

from codegen.messages import NO_MESSAGE, Message
from codegen.reasons import known_text
from visualhfsm._base.environment import child_environment
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._base.output_lines import LineReports, Lines, describe_exit
from visualhfsm._base.recognition import recognized
from visualhfsm._base.work import complete
from visualhfsm._monitor import messages
from visualhfsm._monitor.realm.robot import RobotPresence
from visualhfsm._processes.bodies import body_option, called, require_body
from zenoh_ice import Settings
from zenoh_ice.application.child import ChildProcess
from zenoh_ice.plugins import NotInstalledError, optional

_BALLS: Final = ("red", "green")
_SIMULATION_PATIENCE: Final = (3.0, 2.0)
"""Seconds from SIGINT to SIGTERM, and from there to SIGKILL."""
_ROBOT_PATIENCE: Final = (15.0, 3.0)
"""The same for a real robot, which may have to crouch first."""
_SPEED: Final = re.compile(r"max|\d{1,3}(\.\d{1,3})?")
_ADDRESS: Final = re.compile(r"(?P<scheme>tcps?://)?[A-Za-z0-9][A-Za-z0-9.\-]{0,252}(:\d{1,5})?")
_REPORTED: Final = re.compile(r"^[\w-]+: error: ")
_LEAVING: Final = 3.0
"""Seconds in which a robot that was ended here may still be seen."""

_logger = logging.getLogger(__name__)


_WORLDS: Final = (
    Message("A floor"),
    Message("A floor, and a red and a green ball that are moved by BallRedMotors and BallGreenMotors"),
    Message("Four walls, a table, a crate, boxes that can be pushed, and a ball"),
    Message("A field of the Standard Platform League, a ball on its center, the robot behind it"),
    Message("A field of the Standard Platform League, a ball on its center, two robots of each team"),
    Message("A walled pitch of 14 x 9 m, a ball of 0.35 m radius on its center, two Unitree G1 of each team"),
)
"""The descriptions in the files of the simulation's worlds."""


class WorldFacts(msgspec.Struct, frozen=True):
    """A world of the simulation; `balls` says whether it has balls that can be moved."""

    name: str
    description: Message
    balls: bool


def find_worlds() -> list[WorldFacts]:
    """Return the worlds of the simulation that are installed with it, which is not imported."""
    spec = find_spec("naoserver_sim")
    found = []
    for place in () if spec is None else spec.submodule_search_locations or ():
        for path in sorted((Path(place) / "worlds").glob("*.toml")):
            content = tomllib.loads(path.read_text(encoding="utf-8"))
            description = known_text(content.get("description", ""), _WORLDS)
            found.append(WorldFacts(path.stem, description, bool(content.get("carried_balls"))))
    return found


class StartedRobot:
    """At most one robot's server, with the processes that move its balls. Used on the event loop only.

    All requests raise VisualHfsmError. With `settings`, the processes find the editor; at `endpoints`, other
    programs look for a robot. Bodies of the user's own are below `root`, by default the current folder.
    With a folder for `sockets`, the processes listen there, and nowhere else.
    """

    def __init__(
        self,
        publish: messages.Publish,
        settings: Settings,
        endpoints: Sequence[str] = (),
        root: Path | None = None,
        sockets: Path | None = None,
        *,
        limits: messages.PartLimits = messages.USUAL_LIMITS,
    ) -> None:
        self._publish = publish
        self._limits = limits
        self._settings = settings
        self._endpoints = endpoints
        self._root = root or Path.cwd()
        self._sockets = sockets
        self._server = ChildProcess(LineReports(self._receive), self._end)
        self._movers = {color: ChildProcess(LineReports(_log), self._end_of_mover) for color in _BALLS}
        self._kind: Literal["", "simulation", "real"] = ""
        self._name = ""
        self._simulation = messages.Simulation()
        self._ready = asyncio.Event()
        self._last_error = ""
        self._trouble = NO_MESSAGE
        self._presence = RobotPresence()
        self._was_present = False
        self._lost_at = 0.0
        self._left_at = -_LEAVING
        self._stopping = False
        self._balls: asyncio.Task[None] | None = None
        self._busy = asyncio.Lock()
        self._published: messages.Robot | None = None

    @property
    def state(self) -> messages.Robot:
        """The robot as the page shows it."""
        seen = self._presence
        moving = any(mover.is_running for mover in self._movers.values())
        return messages.Robot(
            status=self._status(),
            simulated=seen.simulated or self._kind == "simulation",
            name=self._name,
            title=called(seen.title),
            speed=seen.speed,
            since=self._lost_at,
            stopped=recognized(seen.stopped or ""),
            started=self._kind,
            simulation=msgspec.structs.replace(self._simulation, balls=moving or self._simulation.balls),
            has_balls=seen.has_balls,
            postures=seen.postures,
            others=tuple(messages.OtherRobot(realm, called(title)) for realm, title in seen.others),
            serves=seen.serves,
            trouble=self._trouble,
        )

    def require_connected(self) -> None:
        """Raise VisualHfsmError while a real robot is being connected: what starts now would drive it."""
        if self._kind == "real" and self._status() == "starting":
            raise VisualHfsmError.because(
                "{name} is being connected: run this when the robot is there and may move", name=self._name
            )

    def observe(self, presence: RobotPresence) -> None:
        """Update the state of the realm's robot."""
        if self._stopping or (presence.present and time.monotonic() - self._left_at < _LEAVING):
            return
        if presence.present and presence.stopped is None and self._kind and not self._was_present:
            return  # a run that waits for it has to know whether it is stopped
        self._left_at = -_LEAVING
        if presence.present:
            self._was_present, self._lost_at = True, 0.0
        elif self._was_present and not self._lost_at:
            self._lost_at = time.time()
            _logger.warning("the robot is lost; it may come back")
        self._presence = presence
        self._report()

    async def simulate(self, simulation: messages.Simulation) -> None:
        """Start a simulated robot, replacing the one that was started here; return before it is present."""
        if simulation.world not in {world.name for world in await asyncio.to_thread(find_worlds)}:
            raise VisualHfsmError.because("the simulation has no world {world}", world=simulation.world[:40])
        if not _SPEED.fullmatch(simulation.speed) or simulation.speed.strip("0.") == "":
            raise VisualHfsmError.because(
                "{speed} is not a speed: write a number above 0, such as 1 or 5", speed=simulation.speed[:40]
            )
        body = await asyncio.to_thread(require_body, self._root, simulation.body)
        simulation = msgspec.structs.replace(simulation, body=body)
        if self._status() == "starting" and self._kind == "simulation" and simulation == self._simulation:
            return  # another window has asked for it already

        def begin() -> None:
            self._simulation = simulation

        options = [
            f"--world={simulation.world}",
            f"--speed={simulation.speed}",
            f"--body={body_option(self._root, body)}",
        ]
        await complete(self._start("simulation", "", "naoserver_sim", options, begin))

    async def connect(self, address: str, start: str, require_rest: Callable[[], None]) -> None:
        """Connect to a real robot by its host, such as nao.local; return before it is present.

        `start` is its first action, as `--start` of `naoserver-naoqi`. A robot that stands up at the start
        crouches at the end. `require_rest` raises VisualHfsmError while something runs that would drive the
        robot: it is asked at the last moment, too.
        """
        match = _ADDRESS.fullmatch(address)
        if match is None:
            raise VisualHfsmError.because(
                "{address} is not a robot address: write nao.local or 192.168.1.20", address=address[:60]
            )
        url = address if match["scheme"] else f"tcp://{address}"
        options = [f"--robot={url}", f"--start={start}", f"--end={'rest' if start == 'stand' else 'leave'}"]
        with VisualHfsmError.in_place_of(NotInstalledError):
            optional("visualhfsm_naoqi", "visualhfsm[naoqi]")
        await complete(self._start("real", address, "visualhfsm_naoqi.robot", options, require_rest))

    async def move_balls(self, *, moving: bool) -> None:
        """Move the balls of the simulation along their routes, or leave them where they are."""
        if moving and not self._presence.has_balls:
            raise VisualHfsmError.because(
                "the simulation has no balls that can be moved: choose the world balls"
            )
        await complete(self._move_balls(moving=moving))

    async def end(self) -> None:
        """End the robot that was started here."""
        if not self._kind:
            raise VisualHfsmError.because("this robot was not started here: end it where it was started")
        await complete(self._stop())

    async def close(self) -> None:
        """End everything, a real robot as requested; processes that take too long are killed."""
        try:
            await self._stop()
        finally:
            for process in (self._server, *self._movers.values()):
                process.kill()

    async def _start(
        self,
        kind: Literal["simulation", "real"],
        name: str,
        module: str,
        options: Sequence[str],
        begin: Callable[[], None],
    ) -> None:
        async with self._busy:  # until it is started: two windows may ask for different robots at once
            if self._presence.present and not self._server.is_running:
                raise VisualHfsmError.because(
                    "there is already a robot that was not started here: end that one first"
                )
            await self._end_all()
            begin()  # which may refuse it: nothing is awaited from here until `require_connected` knows
            self._kind = kind
            self._name = name
            self._trouble = NO_MESSAGE
            self._ready = asyncio.Event()
            self._last_error = ""
            self._report()
            elsewhere = self._sockets is not None or self._settings.mode == "client"
            # The endpoint where others look for it, if that is free and on this machine.
            listen = [] if elsewhere else [f"--listen={messages.free_endpoint(self._endpoints)}"]
            command = [sys.executable, "-P", "-m", module, *listen, *options]
            try:
                await self._launch(self._server, command)
            except VisualHfsmError:
                self._kind = ""
                self._report()
                raise
            if kind == "simulation" and self._simulation.balls:
                self._balls = asyncio.create_task(self._move_balls_when_ready())

    async def _stop(self) -> None:
        """End the running processes; the robot then does not count as lost."""
        async with self._busy:
            await self._end_all()

    async def _end_all(self) -> None:
        """End them while nobody else starts or ends any."""
        if self._balls is not None:
            self._balls.cancel()
            await asyncio.wait({self._balls})
            self._balls = None
        await self._end_movers()
        self._report()
        self._stopping = self._server.is_running
        if self._stopping:
            self._report()
            simulated = self._kind == "simulation"
            await self._server.stop(_SIMULATION_PATIENCE if simulated else _ROBOT_PATIENCE)
            self._left_at, self._stopping = time.monotonic(), False
        self._kind = ""
        self._name = ""
        self._trouble = NO_MESSAGE
        self._was_present, self._lost_at = False, 0.0
        self._presence = RobotPresence()
        self._report()

    async def _end_movers(self) -> None:
        await asyncio.gather(*(mover.stop(_SIMULATION_PATIENCE) for mover in self._movers.values()))

    async def _move_balls_when_ready(self) -> None:
        await self._ready.wait()
        await self._move_balls(moving=True)

    async def _move_balls(self, *, moving: bool) -> None:
        async with self._busy:
            for color, mover in self._movers.items():
                if moving and not mover.is_running:
                    await self._launch(mover, [sys.executable, "-P", "-m", "ballmover", color])
            if not moving:
                await self._end_movers()
            self._simulation = msgspec.structs.replace(self._simulation, balls=moving)
            self._report()

    async def _launch(self, process: ChildProcess, command: Sequence[str]) -> None:
        environment = {**child_environment(), **self._settings.environment()}
        with VisualHfsmError.in_place_of(
            OSError, "{command} cannot be started: {reason}", command=command[3]
        ):
            await process.start(command, {**environment, **messages.own_listener(self._sockets)})

    def _receive(self, written: Lines) -> None:
        _log(written)
        for stream, text in written.lines:
            if stream == "err" and text.strip():
                self._last_error = text
            if text.startswith("ready"):
                self._ready.set()
                asyncio.get_running_loop().call_later(self._limits.appearance, self._expect_seen, self._ready)

    def _expect_seen(self, start: asyncio.Event) -> None:
        if start is self._ready and self._server.is_running and self._status() == "starting":
            self._trouble = Message(
                "The robot's server is ready, but is not seen here: the router may not let this user serve a"
                " robot. Stop it in the robot's menu, and start it where that is allowed."
            )
            self._report()

    def _end(self, code: int, stopped: bool) -> None:
        if stopped:
            return
        reported = _REPORTED.sub("", self._last_error)[:300] if code > 0 else ""
        why = Message.verbatim(reported) if reported else describe_exit(code)
        self._trouble = self._ended(why)
        self._kind = ""
        if self._balls is not None:
            self._balls.cancel()
        for mover in self._movers.values():
            mover.kill()
        self._report()

    def _ended(self, why: Message) -> Message:
        began = self._ready.is_set()
        match self._kind:
            case "simulation" if began:
                return Message("The simulation has ended: {why}", why=why)
            case "simulation":
                return Message("The simulation could not be started: {why}", why=why)
            case _ if began:
                return Message("The connection to {name} has ended: {why}", name=self._name, why=why)
        return Message("The connection to {name} could not be started: {why}", name=self._name, why=why)

    def _end_of_mover(self, _code: int, stopped: bool) -> None:
        """Report that the balls rest; if their simulation has ended, too, the next one moves them again."""
        if not stopped and self._server.is_running:
            self._simulation = msgspec.structs.replace(self._simulation, balls=False)
            self._report()

    def _status(self) -> Literal["none", "starting", "present", "lost", "stopping"]:
        if self._stopping:
            return "stopping"
        if self._presence.present:
            return "present"
        if self._lost_at:
            return "lost"
        return "starting" if self._kind else "none"

    def _report(self) -> None:
        state = self.state
        if state != self._published:
            self._published = state
            self._publish(state)


def _log(written: Lines) -> None:
    for _, text in written.lines:
        _logger.info("%s", text)
