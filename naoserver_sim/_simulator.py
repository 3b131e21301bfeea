"""The physics: stepping the model by a virtual clock, or on a thread at some pace; its clock and pace."""

from __future__ import annotations

import logging
import math
import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Final, NamedTuple, Protocol

import mujoco
import numpy as np
from numpy.typing import NDArray

from naoserver.bodies.parts import MotorHeat
from naoserver.errors import RobotError
from naoserver_sim._motors import Array, Gears, Motors, SetpointController
from naoserver_sim._share import ALONE, RobotData, Share
from naoserver_sim._stepper import STEPS_PER_TICK, Stepper
from zenoh_ice import Clock, VirtualClock
from zenoh_ice.data.text import sentence

_log = logging.getLogger(__name__)

_MOST_TICKS_AT_ONCE = 10
_JOIN_TIMEOUT = 5.0  # s
_ROUNDING = 1e-6
_REMEMBERED: Final = 16
"""Snapshots that are kept: those of 0.15 s."""
_DIVERGED: Final = slice(int(mujoco.mjtWarning.mjWARN_BADQPOS), int(mujoco.mjtWarning.mjWARN_BADCTRL) + 1)


class Snapshot(NamedTuple):
    """A robot's state at the end of a control tick. Its arrays are never modified."""

    time: float
    """Simulated seconds since the start."""
    qpos: Array
    measured: Array
    """The same as encoders report it: another array only while one fails."""
    qvel: Array
    """Of joints whose encoders fail as these report it."""
    setpoints: Array
    forces: Array
    """Force of each motor in N m, or N of a slide."""
    stiffnesses: Array
    """Stiffness of each motor, from 0 to 1."""
    temperatures: Array
    """Temperature of each motor in degrees Celsius."""
    whole_qpos: Array
    """Of everything, the robot itself among it."""
    whole_qvel: Array


class Failing(Protocol):
    """What fails in a body; for the thread of the physics only."""

    def begin(self) -> bool:
        """Begin a tick; return whether anything fails."""

    def command(self, ctrl: Array, lengths: Array, seconds: float) -> None:
        """Change what the motors are to do in the tick, while the joints of all motors are at `lengths`."""

    def measure(self, qpos: Array, qvel: Array) -> tuple[Array, Array]:
        """Return the robot's positions and speeds as encoders report them."""


class Physics:
    """Step a model, and all robots in it, control tick by control tick.

    `advance` steps it in the caller's thread: two of the same model with the same orders before the same
    ticks go through the same states, bit by bit. A virtual clock or a `SimulationClock` calls it.
    """

    def __init__(self, mj: mujoco.MjModel, data: mujoco.MjData) -> None:
        # By default, MuJoCo writes a file into the current directory.
        mujoco.set_mju_user_warning(_log.warning)
        self.mj: Final = mj
        self.data: Final = data
        self.virtual = True
        """True while no thread steps it, but who advances a virtual clock."""
        self.tick_period: Final = float(mj.opt.timestep) * STEPS_PER_TICK
        self.time = 0.0
        """Simulated seconds since the start."""
        self._ticks = 0
        self._simulators: list[Simulator] = []
        self._motors: list[tuple[Motors, RobotData]] = []
        self._stepper = Stepper(mj, data, self._motors)
        self._diverged: NDArray[np.int32] = data.warning.number[_DIVERGED]  # a view

    def add(self, simulator: Simulator) -> None:
        """Step a robot, too."""
        self._simulators.append(simulator)
        self._motors.append((simulator.motors, simulator.data))

    def advance(self, ticks: int) -> None:
        """Step some ticks in the caller's thread and publish each state. Raises RobotError if it explodes."""
        for _ in range(ticks):
            for simulator in self._simulators:
                simulator.begin_tick(self.tick_period)
            self._stepper.tick()
            self._ticks += 1
            # As exact as that of a virtual clock: both give the same paths.
            time = round(self._ticks * self.tick_period, 9)
            for simulator in self._simulators:
                for watch in simulator.watchers:
                    watch(time)
            if any(self._diverged.tolist()):
                raise RobotError(f"the simulation became unstable before {time:.2f} s")
            qpos, qvel = self.data.qpos.copy(), self.data.qvel.copy()
            for simulator in self._simulators:
                simulator.publish(time, qpos, qvel)
            self.time = time
            for simulator in self._simulators:
                simulator.on_tick()

    def publish_again(self) -> None:
        """Publish the state of this tick as it is now."""
        qpos, qvel = self.data.qpos.copy(), self.data.qvel.copy()
        for simulator in self._simulators:
            simulator.publish(self.time, qpos, qvel, again=True)


class Simulator:
    """Move the motors of one robot tick by tick, and keep its states.

    All attributes are for the thread of the physics only; other threads read `newest` and give orders.
    Indices are those of `mj`, a model of the robot alone, which `share` locates in that of the physics.
    """

    def __init__(
        self,
        physics: Physics,
        setpoints: SetpointController,
        gears: Gears | None = None,
        *,
        heat: MotorHeat | None = None,
        mj: mujoco.MjModel | None = None,
        share: Share = ALONE,
    ) -> None:
        self.physics: Final = physics
        self.mj: Final = mj or physics.mj
        self.data: Final = RobotData(physics.data, share)
        self._share = share
        self.setpoints: Final = setpoints
        self.motors: Final = Motors(self.mj, heat, whole=physics.mj, share=share)
        self._gears = gears
        # Actions for the next tick; appending and popping are atomic.
        self._orders: deque[Callable[[], None]] = deque()
        self.parts: Final[list[Callable[[float], None]]] = []
        """Controllers of motors: called at each tick, with its seconds, before the physics moves."""
        self.watchers: Final[list[Callable[[float], None]]] = []
        """Observers of the state at the end of each tick: called with its simulated time in s."""
        self.on_tick: Callable[[], None] = lambda: None
        """Called at the very end of each tick, when its state is published; it gives orders for the next."""
        self.failing: Failing | None = None
        """What fails in the body; None for one that cannot."""
        self._fails = False
        self._meant: Array | None = None  # what `commands` are while something that fails changes them
        self.tick_period: Final = physics.tick_period
        # Views.
        self._ctrl = self.data.ctrl
        self._forces, self._lengths = self.data.actuator_force, self.data.actuator_length
        self._ctrl[:] = setpoints.setpoints
        self.commands: Final[Array] = self._ctrl if gears is None else self._ctrl.copy()
        """Where the motors are to be in this tick; controllers change it."""
        self._snapshots: deque[Snapshot] = deque(maxlen=_REMEMBERED)
        self.publish(physics.time, physics.data.qpos.copy(), physics.data.qvel.copy())
        physics.add(self)

    @property
    def virtual(self) -> bool:
        """Whether no thread steps it, but who advances a virtual clock."""
        return self.physics.virtual

    def newest(self) -> Snapshot:
        """Return the newest snapshot."""
        return self._snapshots[-1]

    def past(self, seconds: float) -> Snapshot:
        """Return the snapshot of some seconds ago, 0.15 at most, or the oldest that there is."""
        ago = round(seconds / self.tick_period) + 1
        return self._snapshots[-min(ago, len(self._snapshots))]

    def order(self, action: Callable[[], None]) -> None:
        """Run an action in the thread of the physics at the next control tick."""
        self._orders.append(action)

    def at_once(self, action: Callable[[], None]) -> None:
        """Run an action now, between two ticks of virtual time, and publish the state after it."""
        action()
        self.physics.publish_again()

    def measure_again(self) -> None:
        """Let the robot have been in its present state for a while: it was placed there, not moved."""
        physics = self.physics
        mujoco.mj_forward(physics.mj, physics.data)
        self.publish(self.newest().time, physics.data.qpos.copy(), physics.data.qvel.copy())
        self._snapshots.extend([self._snapshots[-1]] * _REMEMBERED)

    def put(self, qpos: NDArray[np.intp], dofs: NDArray[np.intp], positions: Array) -> None:
        """Put some joints at positions, at rest; their motors are to `hold` them there."""
        self.data.qpos[qpos] = positions
        self.data.qvel[dofs] = 0.0

    def hold(self, motors: NDArray[np.intp], positions: Array) -> None:
        """Let some motors hold positions at once."""
        self.motors.obey(motors)
        self.setpoints.place(motors, positions, self.commands)
        if self._gears is not None:
            self._gears.settle(motors, positions)

    def move(self, motors: NDArray[np.intp], targets: Array, speeds: Array) -> None:
        """Move the setpoints of some motors to targets, as `SetpointController.move` does."""
        self.motors.obey(motors)
        self.setpoints.move(motors, targets, speeds)

    def follow(self, motors: NDArray[np.intp], commands: Array) -> None:
        """Let some motors follow commands with gains: a row of fields of `JointCommand` for each."""
        self.setpoints.count(motors)
        self.motors.follow(motors, commands)

    def begin_tick(self, period: float) -> None:
        """Command the motors for a tick of `period` s: for `Physics`."""
        motors, setpoints = self.motors, self.setpoints
        if self._meant is not None:
            self._ctrl[:], self._meant = self._meant, None
        while self._orders:
            self._orders.popleft()()
        self._fails = self.failing is not None and self.failing.begin()
        motors.tick(period, motors.torques(self._forces))
        if motors.loose.size:  # the setpoint of a motor that nothing holds follows its joint
            setpoints.place(motors.loose, self._lengths[motors.loose], self.commands)
        setpoints.tick(period, self.commands)
        for part in self.parts:
            part(period)
        if motors.following.size:
            self.commands[motors.following] = motors.targets[motors.following]
        if self._gears is not None:
            self._gears.tick(self.commands, self._lengths, self._ctrl)
        elif self._fails:
            self._meant = self._ctrl.copy()
        motors.stick(self._lengths, self._ctrl)
        if self._fails and self.failing is not None:
            self.failing.command(self._ctrl, self._lengths, period)

    def publish(self, time: float, qpos: Array, qvel: Array, *, again: bool = False) -> None:
        """Keep a state of everything, and of its motors: for `Physics`; `again`, instead of the newest."""
        if again:
            self._snapshots.pop()
        own, speeds = qpos[self._share.qpos], qvel[self._share.dofs]
        measured = own
        if self._fails and self.failing is not None:
            measured, speeds = self.failing.measure(own, speeds)
        self._snapshots.append(
            Snapshot(
                time,
                own,
                measured,
                speeds,
                self.setpoints.setpoints,
                self.motors.torques(self._forces),
                self.motors.stiffnesses,
                self.motors.temperatures,
                qpos,
                qvel,
            )
        )


_SHORTEST_SLEEP: Final = 0.0005  # s
_LONGEST_SLEEP: Final = 0.05  # s


class SimulationClock:
    """Step the physics on a thread at some pace, and give its time, tick by tick. Implements zenoh_ice.Clock.

    No thread waits for another: orders are executed at each control tick, and readers take the newest
    snapshot, an object that is replaced and never changed.
    """

    simulated: Final = True

    def __init__(self, physics: Physics, pacer: Pacer) -> None:
        self._physics = physics
        self._pacer = pacer
        self._ending = threading.Event()
        self._thread: threading.Thread | None = None
        physics.virtual = False
        self.failure: BaseException | None = None
        """The exception that ended the physics thread, if any."""

    @property
    def running(self) -> bool:
        """Whether the physics thread steps the model."""
        return self._thread is not None and self._thread.is_alive()

    @property
    def rate(self) -> float:
        """Simulated seconds in a second of wall time, over the last second; 0 when it stands still."""
        return self._pacer.real_time_factor if self.running else 0.0

    @property
    def lag(self) -> float:
        """Wall seconds by which simulated time lagged behind its schedule in the last second."""
        return self._pacer.lag

    def now(self) -> float:
        return self._physics.time

    def sleep(self, seconds: float) -> None:
        """Wait for a duration in s; returns early when the simulation ends."""
        self.wait(threading.Event(), seconds)

    def wait(self, event: threading.Event, timeout: float) -> bool:
        end = self.now() + timeout
        while self.running and (left := end - self.now()) > 0:
            nap = min(max(left / max(self.rate, 1e-3), _SHORTEST_SLEEP), _LONGEST_SLEEP)
            if event.wait(nap):
                return True
        return event.is_set()

    def start(self) -> None:
        """Start the physics thread."""
        thread = threading.Thread(target=self._run, name="physics", daemon=True)
        thread.start()
        self._thread = thread  # not earlier: one that could not be started cannot be joined

    def close(self) -> None:
        """End the physics thread and wait until it has ended."""
        self._ending.set()
        if self._thread is not None:
            self._thread.join(_JOIN_TIMEOUT)
            if self._thread.is_alive():
                _log.error("the physics thread did not end within %g s", _JOIN_TIMEOUT)

    def _run(self) -> None:
        pacer = self._pacer
        pacer.start(self.now(), self._physics.tick_period)
        try:
            while not self._ending.is_set():
                if ticks := pacer.due(self.now(), _MOST_TICKS_AT_ONCE):
                    self._physics.advance(ticks)
                    pacer.record(self.now())
                else:
                    self._ending.wait(pacer.wait_time(self.now()))
        except BaseException as error:  # noqa: BLE001 - readers must learn of it: see `failure`
            self.failure = error
            _log.exception("the physics stopped at %.3f s", self.now())


class RunningPhysics:
    """Physics and the clock that drives them: a virtual one of the caller's, or a thread at some speed."""

    def __init__(self, physics: Physics, speed: float = 1.0, clock: VirtualClock | None = None) -> None:
        self.physics: Final = physics
        self.clock: Clock
        self._paced: SimulationClock | None = None
        if clock is None:
            self.clock = self._paced = SimulationClock(physics, Pacer(speed))
            self.close: Callable[[], None] = self._paced.close
            """End the thread of the physics."""
        else:
            self.clock = clock
            self.close = clock.call_every(physics.tick_period, lambda: physics.advance(1))

    @property
    def lag(self) -> float:
        """Wall seconds by which simulated time lagged behind its schedule in the last second."""
        return self._paced.lag if self._paced else 0.0

    def start(self) -> None:
        """Start the thread of the physics; with a virtual clock there is none."""
        if self._paced:
            self._paced.start()

    def check(self) -> None:
        """Raise RobotError when an error has stopped the physics."""
        if self._paced and (failure := self._paced.failure):
            raise RobotError(sentence(f"the physics stopped: {failure}")) from failure


WINDOW = 1.0
"""Wall seconds over which the real-time factor and the lag are measured."""
SAMPLE_INTERVAL = 0.05  # s
MAX_LAG = 0.25
"""Wall seconds of lag after which the schedule is shifted: lost time is not made up for in a burst."""
SHORTEST_WAIT = 0.001
"""Shortest wait in s: shorter ones are not worth it, so at a high speed several ticks are due at once."""
_SLOW, _KEPT = 0.9, 0.97
"""Shares of the speed below which the computer does not keep up, and above which it keeps up again."""
_SLIPS = "the computer does not keep up with speed %g: robot time slips, it runs at %.3g"


class _Sample(NamedTuple):
    wall: float
    simulated: float
    lag: float


class Pacer:
    """Pace simulated time against the steady wall clock.

    The schedule is a straight line from an anchor, so that waits of a wrong length do not add up to a drift.
    `speed` is in simulated seconds per wall second; `math.inf` is as fast as possible.
    """

    def __init__(self, speed: float, wall: Callable[[], float] = time.monotonic) -> None:
        if not speed > 0:
            message = f"the speed is {speed}; give a factor above 0, or 'max'"
            raise ValueError(message)
        self.speed = speed
        self._period = 0.0
        self._wall = wall
        self._anchor_wall = wall()
        self._anchor_simulated = 0.0
        self._samples: deque[_Sample] = deque()
        self._worst = 0.0
        self._slow = False
        self.real_time_factor = 0.0
        """Simulated seconds in a wall second, over the last second."""
        self.lag = 0.0
        """The longest delay in wall s of a tick against its schedule within the last second."""
        self.slips = 0
        """Number of shifts of the schedule because the computer did not keep up."""

    def start(self, simulated: float, period: float) -> None:
        """Begin the schedule now, at the given simulated time, with a tick every `period` s of it."""
        self._period = period
        self._anchor_wall = self._wall()
        self._anchor_simulated = simulated
        self._samples = deque([_Sample(self._anchor_wall, simulated, 0.0)])
        self.real_time_factor = 0.0 if math.isinf(self.speed) else self.speed

    def due(self, simulated: float, limit: int) -> int:
        """Return how many periods are due now, at most `limit`."""
        if math.isinf(self.speed):
            return limit
        late = self._late(simulated)
        if late < 0:
            return 0
        self._worst = max(self._worst, late)
        if late > MAX_LAG:
            self.slips += 1
            self._anchor_wall += late
            return 1
        return min(1 + int(late * self.speed / self._period + _ROUNDING), limit)

    def wait_time(self, simulated: float) -> float:
        """Return the wall seconds to wait before asking again."""
        return max(SHORTEST_WAIT, -self._late(simulated))

    def record(self, simulated: float) -> None:
        """Record the simulated time reached, for the real-time factor and the lag."""
        wall = self._wall()
        if wall - self._samples[-1].wall < SAMPLE_INTERVAL:
            return
        self._samples.append(_Sample(wall, simulated, self._worst))
        self._worst = 0.0
        while len(self._samples) > 2 and wall - self._samples[0].wall > WINDOW:
            self._samples.popleft()
        oldest = self._samples[0]
        self.real_time_factor = (simulated - oldest.simulated) / (wall - oldest.wall)
        if len(self._samples) > 2 and wall - oldest.wall > WINDOW / 2 and not math.isinf(self.speed):
            share = self.real_time_factor / self.speed
            if share < _SLOW and not self._slow:
                _log.warning(_SLIPS, self.speed, self.real_time_factor)
            self._slow = share < (_KEPT if self._slow else _SLOW)
        self.lag = max(sample.lag for sample in self._samples)

    def _late(self, simulated: float) -> float:
        """Return the wall seconds since the tick after `simulated` was due; negative before it is."""
        scheduled = (simulated + self._period - self._anchor_simulated) / self.speed
        return self._wall() - self._anchor_wall - scheduled
