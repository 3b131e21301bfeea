"""The physics: the model stepped on a thread at its pace, or after a virtual clock; and its clock."""

from __future__ import annotations

import logging
import math
import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Protocol

import mujoco
import numpy as np
from numpy.typing import NDArray

from naoserver.errors import RobotError
from naoserver_sim.motors import Command, Motors, SetpointController
from naoserver_sim.pacing import Pacer

if TYPE_CHECKING:
    from zenoh_ice import Clock
import time

_log = logging.getLogger(__name__)

STEPS_PER_TICK = 4
"""Physics steps in a control tick: 2.5 ms each, 10 ms in all, the cycle of the robot's motor boards."""
_MOST_TICKS_AT_ONCE = 10
_JOIN_TIMEOUT = 5.0
_ROUNDING = 1e-6
_DIVERGED = [
    int(warning)
    for warning in (
        mujoco.mjtWarning.mjWARN_BADQPOS,
        mujoco.mjtWarning.mjWARN_BADQVEL,
        mujoco.mjtWarning.mjWARN_BADQACC,
        mujoco.mjtWarning.mjWARN_BADCTRL,
    )
]
_SENSORS = int(mujoco.mjtDisableBit.mjDSBL_SENSOR)

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Snapshot:
    """The state at the end of a control tick. Its arrays are never written to again."""

    time: float
    """Simulated seconds since the start."""
    qpos: Array
    qvel: Array
    setpoints: Array
    forces: Array
    """Force of each motor in N m, or N of a slide."""
    stiffnesses: Array
    """How strongly each motor holds, from 0 to 1."""
    temperatures: Array
    """Of each motor in degrees Celsius."""


class Part(Protocol):
    """What moves motors by itself, tick by tick, such as the walk."""

    def tick(self, seconds: float) -> None:
        """Go on for some seconds, before the physics does; belongs to the thread of the physics."""
        ...


class Watcher(Protocol):
    """What looks at the state tick by tick, such as the senses."""

    def look(self, time: float) -> None:
        """Look at the state at the end of a tick: a simulated time in s; in the thread of the physics."""
        ...


class Simulator:
    """Step a model control tick by control tick.

    `advance` steps it in the caller's thread: two simulators of the same model that get the same commands
    before the same ticks go through the same states, bit by bit. Who makes time pass is up to the subclasses.
    """

    def __init__(self, mj: mujoco.MjModel, data: mujoco.MjData, controller: SetpointController) -> None:
        # MuJoCo's own way is to write a file into the current directory.
        mujoco.set_mju_user_warning(_log.warning)
        self._mj = mj
        self._data = data
        self._controller = controller
        self.motors: Final = Motors(mj)
        """The stiffness and temperature of the motors; belongs to the thread of the physics."""
        # What is to be done at the next tick; appending and popping is atomic.
        self._orders: deque[Callable[[], None]] = deque()
        self.parts: Final[list[Part]] = []
        """What goes on at each tick after the setpoints have moved and before the physics does."""
        self.watchers: Final[list[Watcher]] = []
        """What looks at the state at the end of each tick."""
        self._ticks = 0
        self.tick_period: float = float(mj.opt.timestep) * STEPS_PER_TICK
        self._data.ctrl[:] = controller.setpoints
        self._snapshot = self._take_snapshot()

    @property
    def real_time_factor(self) -> float:
        """Simulated seconds in a wall second, over the last second."""
        return 1.0

    @property
    def lag(self) -> float:
        """Wall seconds by which simulated time lagged behind its schedule in the last second."""
        return 0.0

    def newest(self) -> Snapshot:
        """Return the newest snapshot."""
        self.catch_up()
        return self._snapshot

    def catch_up(self) -> None:
        """Step the physics up to the clock's time, unless a thread does: for readers of what it changes."""

    def post(self, command: Command) -> None:
        """Hand over a command; it takes effect at the next control tick."""
        self._controller.post(command)

    def stiffen(self, motors: NDArray[np.intp], stiffnesses: Array, seconds: float) -> None:
        """Change how strongly some motors hold within some simulated seconds, from the next tick on."""
        self.order(lambda: self.motors.stiffen(motors, stiffnesses, seconds))

    def order(self, action: Callable[[], None]) -> None:
        """Have something done by the thread of the physics at the next tick."""
        self._orders.append(action)

    def advance(self, ticks: int) -> None:
        """Step some control ticks in the caller's thread and publish the state after the last.

        Raises RobotError when the numbers explode.
        """
        data, motors, controller = self._data, self.motors, self._controller
        for _ in range(ticks):
            while self._orders:
                self._orders.popleft()()
            motors.tick(self.tick_period, data.actuator_force)
            if motors.limp.size:
                controller.follow(motors.limp, data.actuator_length[motors.limp])
            controller.tick(self.tick_period, data.ctrl)
            for part in self.parts:
                part.tick(self.tick_period)
            self._step()
            self._ticks += 1
            for watcher in self.watchers:
                watcher.look(self._ticks * self.tick_period)
        if self._data.warning.number[_DIVERGED].any():
            raise RobotError(f"the simulation became unstable before {self._ticks * self.tick_period:.2f} s")
        self._snapshot = self._take_snapshot()

    def _step(self) -> None:
        """Step the physics for a tick. The sensors measure in its last step alone: nobody looks before."""
        option = self._mj.opt
        option.disableflags |= _SENSORS
        mujoco.mj_step(self._mj, self._data, nstep=STEPS_PER_TICK - 1)
        option.disableflags &= ~_SENSORS
        mujoco.mj_step(self._mj, self._data)

    def _take_snapshot(self) -> Snapshot:
        data = self._data
        return Snapshot(
            time=self._ticks * self.tick_period,
            qpos=data.qpos.copy(),
            qvel=data.qvel.copy(),
            setpoints=self._controller.setpoints,
            forces=data.actuator_force.copy(),
            stiffnesses=self.motors.stiffnesses.copy(),
            temperatures=self.motors.temperatures.copy(),
        )


class PacedSimulator(Simulator):
    """Step the model on a thread of its own, at its pace.

    Nobody waits for anybody: commands are posted to a mailbox that is emptied at each control tick, and
    readers take the newest snapshot, an object that is replaced and never changed.
    """

    def __init__(
        self, mj: mujoco.MjModel, data: mujoco.MjData, controller: SetpointController, pacer: Pacer
    ) -> None:
        super().__init__(mj, data, controller)
        self._pacer = pacer
        self._ending = threading.Event()
        self._thread: threading.Thread | None = None
        self.failure: Exception | None = None
        """What ended the physics thread before its time."""

    @property
    def running(self) -> bool:
        """Whether the physics thread steps the model."""
        return self._thread is not None and self._thread.is_alive()

    @property
    def real_time_factor(self) -> float:
        """Simulated seconds in a wall second, over the last second; 0 while the physics stands still."""
        return self._pacer.real_time_factor if self.running else 0.0

    @property
    def lag(self) -> float:
        """Wall seconds by which simulated time lagged behind its schedule in the last second."""
        return self._pacer.lag

    def post(self, command: Command) -> None:
        """Hand over a command; it takes effect at the next control tick. Ignored after `close`."""
        if not self._ending.is_set():
            super().post(command)

    def order(self, action: Callable[[], None]) -> None:
        """Have something done by the thread of the physics at the next tick. Ignored after `close`."""
        if not self._ending.is_set():
            super().order(action)

    def start(self) -> None:
        """Start the physics thread."""
        self._thread = threading.Thread(target=self._run, name="physics", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the physics thread and wait until it has ended."""
        self._ending.set()
        if self._thread is not None:
            self._thread.join(_JOIN_TIMEOUT)
            if self._thread.is_alive():
                _log.error("the physics thread did not end within %g s", _JOIN_TIMEOUT)

    def _run(self) -> None:
        try:
            self._keep_pace()
        except Exception as error:  # noqa: BLE001 - whatever it is, readers must hear of it: see `failure`
            self.failure = error
            _log.exception("the physics stopped at %.3f s", self._snapshot.time)

    def _keep_pace(self) -> None:
        pacer = self._pacer
        pacer.start(self._snapshot.time, self.tick_period)
        while not self._ending.is_set():
            ticks = pacer.due(self._snapshot.time, _MOST_TICKS_AT_ONCE)
            if ticks:
                slips = pacer.slips
                self.advance(ticks)
                pacer.record(self._snapshot.time)
                if slips == 0 and pacer.slips:
                    _log.warning("the computer does not keep up with speed %g: robot time slips", pacer.speed)
            else:
                self._ending.wait(pacer.wait_time(self._snapshot.time))


class VirtualSimulator(Simulator):
    """Step the model up to a virtual clock's time whenever somebody looks or commands."""

    def __init__(
        self, mj: mujoco.MjModel, data: mujoco.MjData, controller: SetpointController, clock: Clock
    ) -> None:
        super().__init__(mj, data, controller)
        self._clock = clock
        self._begin = clock.now()
        self._lock = threading.Lock()
        self._closed = False

    def catch_up(self) -> None:
        """Step the physics up to the last control tick before the clock's time."""
        with self._lock:
            self._catch_up()

    def post(self, command: Command) -> None:
        """Hand over a command; it takes effect at the first control tick after the clock's time."""
        with self._lock:
            self._catch_up()
            super().post(command)

    def order(self, action: Callable[[], None]) -> None:
        """Have something done at the first control tick after the clock's time."""
        with self._lock:
            self._catch_up()
            super().order(action)

    def place(
        self, qpos: NDArray[np.intp], dofs: NDArray[np.intp], motors: NDArray[np.intp], positions: Array
    ) -> None:
        """Put some joints somewhere at once, at rest."""
        with self._lock:
            self._catch_up()
            self._data.qpos[qpos] = positions
            self._data.qvel[dofs] = 0.0
            self._controller.place(motors, positions, self._data.ctrl)
            self._snapshot = self._take_snapshot()

    def start(self) -> None:
        """Do nothing: the clock makes the time pass."""

    def close(self) -> None:
        """Let the clock run on without the model."""
        with self._lock:
            self._closed = True

    def _catch_up(self) -> None:
        elapsed = self._clock.now() - self._begin
        ticks = math.floor(elapsed / self.tick_period + _ROUNDING) - self._ticks
        if ticks > 0 and not self._closed:
            self.advance(ticks)


_SHORTEST: Final = 0.0005
_LONGEST: Final = 0.05


class SimulationClock:
    """The time of a simulator that keeps its own pace; it moves on with each control tick."""

    simulated: Final = True

    def __init__(self, simulator: PacedSimulator) -> None:
        self._simulator = simulator

    @property
    def rate(self) -> float:
        """Simulated seconds in a second of wall time, over the last second; 0 when it stands still."""
        return self._simulator.real_time_factor

    def now(self) -> float:
        """Return the seconds since the start of the simulation."""
        return self._simulator.newest().time

    def sleep(self, seconds: float) -> None:
        """Wait for a duration in s; returns early when the simulation ends."""
        self.sleep_until(self.now() + seconds)

    def sleep_until(self, when: float) -> None:
        """Wait until the clock shows `when`; returns early when the simulation ends."""
        while self._simulator.running and (left := when - self.now()) > 0:
            time.sleep(self._nap(left))

    def wait(self, event: threading.Event, timeout: float) -> bool:
        """Wait for an event for at most `timeout` s of simulated time; return whether it is set."""
        end = self.now() + timeout
        while self._simulator.running and (left := end - self.now()) > 0:
            if event.wait(self._nap(left)):
                return True
        return event.is_set()

    def _nap(self, left: float) -> float:
        """Return how long to sleep on the wall before looking at the time again."""
        return min(max(left / max(self.rate, 1e-3), _SHORTEST), _LONGEST)
