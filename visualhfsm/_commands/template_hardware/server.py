"""Serve my robot: servos on a bus, a camera and an inertial unit. Simulated or real: --bus says which."""

import fcntl
import math
import os
import select
import termios
import threading
import time
import tty
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import typer

from naoserver.bodies import read_body_file
from naoserver.bodies.capabilities import InertialReading, SenseReading
from naoserver.errors import HardwareFailure, RobotError
from naoserver.fake import Ball, view
from naoserver.hardware.lifecycle import End, Start
from naoserver.hardware.serving import SERVER_DEFAULTS, serve_hardware
from naoserver.hardware.servos import Servo, ServoRobot
from naoserver.hardware.sim_bus import SimBus
from naoserver.options import ServerOptions, capped
from naoserver.robot import Frame
from naoserver.serving.server import JointSpeed
from zenoh_ice.application.cli import run, with_settings
from zenoh_ice.settings import Settings

BODY = read_body_file(Path(__file__).with_name("bust.toml"))
IDS = {joint.name: number for number, joint in enumerate(BODY.joints, start=1)}
NAMES = {number: name for name, number in IDS.items()}
SIMULATED = "simulated"


class Bus:
    """The line to the servos: replace what it writes and reads. It does what ServoBus promises."""

    def __init__(self, path: str) -> None:
        self.lost = threading.Event()
        self._line = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        try:
            fcntl.flock(self._line, fcntl.LOCK_EX | fcntl.LOCK_NB)  # two servers would fight over the servos
            tty.setraw(self._line)
        except (BlockingIOError, termios.error) as error:
            os.close(self._line)
            why = "another server has it" if isinstance(error, OSError) else "it is no serial line"
            raise HardwareFailure(f"{path}: {why}") from error
        self._number = 0

    def read(self) -> dict[str, Servo]:
        """Ask all servos at once, and wait 15 ms at most for their answers."""
        self._number += 1
        self._send(self._number, "read")
        found: dict[str, Servo] = {}
        received = b""
        end = time.monotonic() + 0.015
        while len(found) < len(IDS) and (left := end - time.monotonic()) > 0:
            if not select.select([self._line], [], [], left)[0]:
                break
            *lines, received = (received + os.read(self._line, 4096)).split(b"\n")
            for line in lines:
                with suppress(ValueError, KeyError):  # a line that noise has damaged is no answer
                    number, servo, *values = line.split()
                    position, velocity, torque, temperature, holds, overload = map(float, values)
                    fault = "overload: its torque is off" if overload else ""
                    if int(number) == self._number:  # no late answer to an earlier question
                        found[NAMES[int(servo)]] = Servo(
                            position, velocity, torque, holds, temperature, fault
                        )
        return found

    def move(self, setpoints: Mapping[str, float]) -> None:
        """Send servos a small step on. It is called 50 times a second, so that the bus's watchdog rests."""
        self._send("move", *(f"{IDS[joint]} {angle:.5f}" for joint, angle in setpoints.items()))

    def stiffen(self, stiffnesses: Mapping[str, float]) -> None:
        """Switch the torque of servos: these know only on and off."""
        self._send("hold", *(f"{IDS[joint]} {value >= 0.05:d}" for joint, value in stiffnesses.items()))

    def close(self) -> None:
        if not self.lost.is_set():
            self.lost.set()
            os.close(self._line)

    def _send(self, *words: object) -> None:
        os.write(self._line, " ".join(map(str, words)).encode() + b"\n")


class InertialUnit:
    """The inertial unit: read yours in `inertial`. This one is upright and at rest."""

    touch_names: tuple[str, ...] = ()
    sonar_range = None
    sonar_cone = 0.0

    def inertial(self) -> InertialReading:
        return InertialReading(acceleration=(0.0, 0.0, 9.81))

    def read(self) -> SenseReading:
        return SenseReading(time.monotonic(), self.inertial())


class Bust(ServoRobot):
    """My robot. What it has besides servos, such as lights or a voice, becomes a member here."""

    def __init__(self, bus: str = SIMULATED, start: Start = Start.LEAVE, end: End = End.LEAVE) -> None:
        self.simulated = SimBus(len(IDS)) if bus == SIMULATED else None
        path = str(self.simulated.path) if self.simulated else bus
        unit = InertialUnit()
        super().__init__(BODY, lambda _: Bus(path), capture=self.picture, senses=unit, start=start, end=end)
        self._video: Any = None  # of OpenCV, when a picture is first taken

    def picture(self, camera: str, width: int, height: int) -> Frame:
        """Take a picture by the computer's first camera; beside a simulated bus, draw a ball that swings."""
        now = self.clock.now()
        if self.simulated:
            ball = Ball(pan=0.5 * math.sin(0.5 * now), distance=1.0, height=0.6)
            return view(BODY, BODY.cameras[0], self.read(), (width, height), [(ball, (30, 200, 40))])
        import cv2

        self._video = self._video or cv2.VideoCapture(0)
        taken, image = self._video.read()
        if not taken:
            raise HardwareFailure(f"{camera}: no picture")
        pixels = cv2.cvtColor(cv2.resize(image, (width, height)), cv2.COLOR_BGR2RGB)
        return Frame(camera, now, width, height, np.ascontiguousarray(pixels))

    def close(self) -> None:
        super().close()
        if self.simulated:
            self.simulated.close()


def make() -> Bust:
    """Return the robot as it is tested: on a simulated bus."""
    return Bust()


app = typer.Typer(add_completion=False)


@app.command()
@with_settings(defaults=SERVER_DEFAULTS)
def main(
    *,
    settings: Settings,
    bus: str = SIMULATED,
    start: Start = Start.LEAVE,
    end: End = End.LEAVE,
    joint_speed: JointSpeed = None,
) -> None:
    """Serve my robot on the line at the path --bus, such as /dev/ttyUSB0, or on a simulated bus."""
    options = ServerOptions(safety=capped(joint_speed))
    robot = Bust(bus, start, end)
    serve_hardware(robot, settings, options, lifecycle=robot.lifecycle, where=f"bus {bus}")


if __name__ == "__main__":
    run(app, expected=(RobotError,))
