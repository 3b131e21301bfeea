"""The physics: a thread that steps the model at its pace and publishes what came of it."""

from __future__ import annotations

import logging
import threading
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from naoserver_sim.control import Command, SetpointController
from naoserver_sim.pacing import Pacer

_log = logging.getLogger(__name__)

STEPS_PER_TICK = 4
"""Physics steps in a control tick: 2.5 ms each, 10 ms in all, the cycle of the robot's motor boards."""
_MOST_TICKS_AT_ONCE = 10
_JOIN_TIMEOUT = 5.0

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


class Simulator:
    """Step a model on its own thread (`start`), or from the caller's (`advance`).

    Nobody waits for anybody: commands are posted to a mailbox that is emptied at each control tick, and
    readers take the newest `snapshot`, an object that is replaced and never changed.
    """

    def __init__(
        self, model: mujoco.MjModel, data: mujoco.MjData, controller: SetpointController, pacer: Pacer
    ) -> None:
        self._model = model
        self._data = data
        self._controller = controller
        self.pacer = pacer
        self.tick_period = float(model.opt.timestep) * STEPS_PER_TICK
        self._ticks = 0
        self._ending = threading.Event()
        self._thread: threading.Thread | None = None
        self._data.ctrl[:] = controller.setpoints
        self.failure: BaseException | None = None
        """What ended the physics thread before its time."""
        self.snapshot = self._take_snapshot()

    @property
    def running(self) -> bool:
        """Whether the physics thread steps the model."""
        return self._thread is not None and self._thread.is_alive()

    def post(self, command: Command) -> None:
        """Hand over a command; it takes effect at the next control tick. Ignored after `close`."""
        if not self._ending.is_set():
            self._controller.post(command)

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

    def advance(self, ticks: int) -> None:
        """Step the given number of control ticks in the caller's thread and publish the last.

        Two simulators of the same model that get the same commands before the same ticks go through the same
        states, bit by bit.
        """
        while ticks > 0:
            self._controller.tick(self.tick_period, self._data.ctrl)
            # Nothing moves a setpoint before the next command: the physics may run on by itself.
            together = 1 if self._controller.moving else ticks
            mujoco.mj_step(self._model, self._data, nstep=STEPS_PER_TICK * together)
            self._ticks += together
            ticks -= together
        self.snapshot = self._take_snapshot()

    def _take_snapshot(self) -> Snapshot:
        data = self._data
        return Snapshot(
            time=self._ticks * self.tick_period,
            qpos=data.qpos.copy(),
            qvel=data.qvel.copy(),
            setpoints=self._controller.setpoints,
            forces=data.actuator_force.copy(),
        )

    def _run(self) -> None:
        try:
            self._keep_pace()
        except Exception as error:  # noqa: BLE001 - whatever it is, readers must hear of it: see `failure`
            self.failure = error
            _log.exception("the physics stopped at %.3f s", self.snapshot.time)

    def _keep_pace(self) -> None:
        pacer = self.pacer
        pacer.start(self.snapshot.time, self.tick_period)
        while not self._ending.is_set():
            ticks = pacer.due(self.snapshot.time, _MOST_TICKS_AT_ONCE)
            if ticks:
                slips = pacer.slips
                self.advance(ticks)
                pacer.record(self.snapshot.time)
                if slips == 0 and pacer.slips:
                    _log.warning("the computer does not keep up with speed %g: robot time slips", pacer.speed)
            else:
                self._ending.wait(pacer.wait_time(self.snapshot.time))
