"""The protocol of a robot: the only boundary between the servants and a body.

The simulated robot, the real one and the fake one implement `Robot`; all share the servants and the safety
layer above it.

Contract of every implementation
--------------------------------
- **Threads.** Every method may be called from any thread at any time between `start` and `close`. `read`
  and `state` are snapshots that never block (publish an immutable object, return the newest); `command_*`
  store the command and return at once. `Senses.read` is another one: the senses are another object.
- **Setpoints.** A joint follows a setpoint, which `JointReading.commands` reports. A position command moves
  the setpoint from where it is to the target at no more than the given speed; a velocity command moves it
  at that velocity until the next command. Velocity 0 holds the setpoint where it is. The newest command of
  a joint replaces the one before, of either kind; joints that a command does not name keep theirs.
  Commands take effect at the next control tick. The setpoint of a limp motor follows its joint, so that
  nothing jumps when it becomes stiff again; so does that of a motor that follows a command with gains,
  until the next position or velocity.
- **Small steps.** A server that is killed or hangs must not leave a motor on its way to a far goal: send
  setpoints in small steps, and set the watchdog of the bus, which holds every motor once nothing comes.
  Hardware that has none, and goes to its goals by itself, needs a process that stops it then.
- **Control.** A robot with a `control_loop` ticks it at the end of every control tick, with its new state
  published; it waits for the jobs there, and its time with it.
- **Safety.** Commands have been made safe by the layer above (finite, in range, limited in speed). An
  implementation may limit further, and keeps its setpoints inside `JointFacts.lower` and `upper`.
- **Refusals.** `command_*` raise nothing for a robot or a joint that is lost: they do nothing, as the layer
  above has refused what it could. A command that cannot be passed on raises HardwareFailure, and its client
  gets `UnknownException` with the message; a command to stop is passed on by all means.
- **Units.** SI and radians, about the axes that the body's description gives the joints.
- **Loss.** What serves a real robot calls `Gate.lose` once no command reaches it, and `Gate.find` when they
  do again (`Assembly.gate`), and adds an event (`Assembly.events`). Meanwhile `read`, `state` and the senses
  return what was measured last, velocities too, with its time: whether the joints move is not known, and
  the state of Safety says so. Found again, joints rest where they are: nothing that was commanded before the
  loss is carried out. The loss of a single servo is a fault in `JointReading.faults`.
- **Stop.** The server passes the open `latch_of` its settings to `serve`. A robot that was stopped, as
  `latch.found.stop` says, does not move at the start, nor does one whose server ended without warning.
- **Life.** `start` once, `close` any number of times, also without `start`. After `close`, `read` and
  `state` return the last snapshot, commands are ignored, `capture` raises `HardwareFailure`.

`naoserver.hardware` does all that for servos on a bus (docs/how-to/own-hardware.md).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from naoserver.bodies.capabilities import (
    Balancer,
    Eyes,
    GainControl,
    Lights,
    Loudspeaker,
    OwnPostures,
    Senses,
    Stage,
    Voice,
    Walker,
)
from naoserver.bodies.parts import CameraFacts, JointFacts
from zenoh_ice import Clock

if TYPE_CHECKING:
    from naoserver.bodies.body import Body
    from naoserver.protocol.faults import Faults
    from naoserver.protocol.jobs import ControlLoop


@dataclass(frozen=True, slots=True)
class JointFault:
    """What keeps one joint from obeying while the others go on."""

    message: str
    """Such as `overload: it holds nothing until its motor is made stiff again`."""
    lost: bool = False
    """Whether its servo does not answer: its reading is the last one, and commands to it are refused."""


@dataclass(frozen=True, slots=True)
class JointReading:
    """The state of a device's joints at one moment, in the order of `JointDevice.joints`.

    `commands` are the setpoints that the motors follow now, on their way to the commanded targets.
    """

    time: float
    """Robot time in s."""
    positions: tuple[float, ...]
    velocities: tuple[float, ...]
    commands: tuple[float, ...]
    torques: tuple[float, ...]
    stiffnesses: tuple[float, ...]
    """Stiffness of each motor, from 0, limp, to 1."""
    temperatures: tuple[float, ...]
    """Temperatures of the motors in degrees Celsius."""
    faults: Mapping[str, JointFault] = field(default_factory=dict)
    """The joints whose servos are lost or report a fault: Health says each, with the joint."""


@dataclass(frozen=True, slots=True)
class Frame:
    """An image from a robot."""

    camera: str
    time: float
    """Robot time at which it was taken in s."""
    width: int
    height: int
    pixels: NDArray[np.uint8]
    """RGB, shape (height, width, 3), C-contiguous, row 0 on top. Never modified after it was returned."""


LIMP: Final = 0.05
"""Stiffness below which a motor holds nothing."""


@dataclass(frozen=True, slots=True)
class BodyState:
    """State of the robot as a whole."""

    torso_tilt: float
    """Angle between the torso's z axis and the vertical in rad."""
    fallen: bool
    """Whether `torso_tilt` is above the tilt at which the body lies, `Body.lying_tilt`; never if mounted."""
    real_time_factor: float
    """Robot seconds in a wall second, over the last second; 0 while a real robot is unreachable."""
    lag: float
    """Wall seconds by which robot time lags behind its schedule; 0 on a real robot."""


class JointDevice(Protocol):
    """Something with joints that can be read and commanded: a robot, or a mechanism that carries a ball."""

    @property
    def name(self) -> str:
        """What people call the robot; of a mechanism the first part of its identities, such as `BallRed`."""

    @property
    def joints(self) -> tuple[JointFacts, ...]:
        """The joints in the order of every reading; constant for the device's life."""

    def read(self) -> JointReading:
        """Return the newest snapshot of the joints without blocking."""

    def command_positions(self, targets: Mapping[str, float], max_speeds: Mapping[str, float]) -> None:
        """Move the setpoints of some joints to `targets`, each at no more than its speed in `max_speeds`."""

    def command_velocities(self, velocities: Mapping[str, float]) -> None:
        """Move the setpoints of some joints at `velocities` until further notice; 0 holds."""

    def command_stiffnesses(self, stiffnesses: Mapping[str, float], seconds: float) -> None:
        """Change how strongly some motors hold to `stiffnesses`, from 0 to 1, within some robot seconds."""


@runtime_checkable
class Robot(JointDevice, Protocol):
    """A robot that can be served. Its joints are those of its body, in order."""

    @property
    def body(self) -> Body:
        """The description of its body: what that lacks, the robot lacks, too."""

    @property
    def cameras(self) -> tuple[CameraFacts, ...]:
        """The cameras that `capture` accepts."""

    @property
    def clock(self) -> Clock:
        """The robot's time: simulated (at any pace), or steady wall time of a real robot."""

    @property
    def mechanisms(self) -> tuple[JointDevice, ...]:
        """Devices besides the robot: the balls of a simulation; empty on a real robot."""

    @property
    def gains(self) -> GainControl | None:
        """What lets its motors follow commands with gains; None when they cannot."""

    @property
    def walker(self) -> Walker | None:
        """Its walk; None when it has none."""

    @property
    def balancer(self) -> Balancer | None:
        """What keeps it upright while its legs are commanded; None when it has none."""

    @property
    def senses(self) -> Senses | None:
        """Its senses, except joints and cameras; None when it has none."""

    @property
    def eyes(self) -> Eyes | None:
        """What knows what its cameras show; None for a robot that has pictures only."""

    @property
    def lights(self) -> Lights | None:
        """Its lights; None when it has none."""

    @property
    def voice(self) -> Voice | None:
        """Its voice; None when it has none."""

    @property
    def loudspeaker(self) -> Loudspeaker | None:
        """What plays sounds; None when it has none."""

    @property
    def postures(self) -> OwnPostures | None:
        """The robot's own way into postures; None if the server's key frames are to be used."""

    @property
    def stage(self) -> Stage | None:
        """The scene around it, which only a simulation can change; None for a real robot."""

    @property
    def faults(self) -> Faults | None:
        """What of it fails because somebody lets it; None for a real robot, which fails by itself."""

    @property
    def control_loop(self) -> ControlLoop | None:
        """The loop in which the server moves it along paths; None if the server's threads are to do so."""

    def looks(self) -> str:
        """Return its visible shapes as JSON, in the frames of its links; empty when it has none."""

    def state(self) -> BodyState:
        """Return the newest snapshot of the body without blocking."""

    def capture(self, camera: str, width: int, height: int) -> Frame:
        """Take an image; blocks at most 1 s.

        Calls for different cameras may overlap. The first frame of a new size may take longer than the next
        ones.

        Raises HardwareFailure when it cannot, naming the missing package when the machine has no GL.
        """

    def start(self) -> None:
        """Start the threads of the robot. Raises RobotError when it cannot be started."""

    def close(self) -> None:
        """Stop all motion, threads and devices; return when they have ended."""
