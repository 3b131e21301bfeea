"""A bus of servos to try a server without hardware: packets over a pseudo terminal, with faults on command.

A packet is 0xFE, the number of its request, its kind, the length of its content, the content, and the sum of
all bytes before modulo 256. A request `R` is answered by a packet `A` of each servo with the number of the
request; `M` sends servos to setpoints, `T` lets them hold or go limp. Angles are rad in 32 bits. Without a
packet for 0.1 s every servo holds where it is: the watchdog of the bus.

As a program, `python -m naoserver.hardware.sim_bus bus.tty --servos 4`, it takes the commands of
`SimBus.command` from its standard input, a line each, and prints the answers.
"""

from __future__ import annotations

import os
import pty
import select
import struct
import sys
import tempfile
import threading
import time
import tty
from collections import deque
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final

import typer

WATCHDOG: Final = 0.1
"""Seconds without a packet after which every servo holds where it is."""
FASTEST: Final = 6.0
"""Speed of a servo in rad/s."""
ANSWER: Final = struct.Struct("<B3fBB?")
"""A servo: number, position, velocity, torque, temperature, whether it holds, whether it was overloaded."""
SETPOINT: Final = struct.Struct("<Bf")
"""The number of a servo, from 1, and its setpoint."""
HOLD: Final = struct.Struct("<B?")
"""The number of a servo, and whether it is to hold."""
_HEADER: Final = 0xFE
_SMOOTHED: Final = 0.02  # s over which a servo measures its velocity


def pack(number: int, kind: bytes, content: bytes = b"") -> bytes:
    """Return a packet."""
    packet = bytes([_HEADER, number & 0xFF]) + kind + bytes([len(content)]) + content
    return packet + bytes([sum(packet) & 0xFF])


def unpack(received: bytearray) -> Iterator[tuple[int, bytes, bytes]]:
    """Yield number, kind and content of each whole packet, and remove it; skip what is damaged."""
    while (start := received.find(_HEADER)) >= 0 and len(received) - start >= 5:
        end = start + 5 + received[start + 3]
        if len(received) < end:
            break
        packet = bytes(received[start:end])
        if sum(packet[:-1]) & 0xFF == packet[-1]:
            del received[:end]
            yield packet[1], packet[2:3], packet[4:-1]
        else:
            del received[: start + 1]


@dataclass
class _Servo:
    position: float = 0.0
    goal: float = 0.0
    velocity: float = 0.0
    temperature: int = 35
    holds: bool = False
    overload: bool = False
    stuck: bool = False
    lost: bool = False

    def move(self, seconds: float) -> None:
        way = self.goal - self.position if self.holds and not self.stuck else 0.0
        step = min(max(way, -FASTEST * seconds), FASTEST * seconds)
        self.position += step
        if seconds:
            self.velocity += (step / seconds - self.velocity) * min(1.0, seconds / _SMOOTHED)
        if not self.holds:
            self.goal = self.position


class SimBus:
    """A bus with servos, numbered from 1, at a pseudo terminal; `path` is a link to it."""

    def __init__(self, servos: int, path: Path | None = None) -> None:
        self._folder = None if path else tempfile.TemporaryDirectory(prefix="sim-bus-")
        self.path: Final = path or Path(self._folder.name if self._folder else "") / "tty"
        self._servos = {number + 1: _Servo() for number in range(servos)}
        self._lock = threading.Lock()
        self._line: tuple[int, int] | None = None
        self._late = 0.0
        self._answers: deque[tuple[float, bytes]] = deque()  # to be sent at a time
        self._heard = self._moved = time.monotonic()
        self._received = bytearray()
        self._closing = threading.Event()
        self._plug()
        self._thread = threading.Thread(target=self._run, name="servo bus", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the bus; does nothing the second time."""
        self._closing.set()
        self._thread.join()
        self._unplug()
        if self._folder is not None:
            self._folder.cleanup()

    def command(self, line: str) -> str:
        """Do what a line says, and return the answer; raise ValueError for one that is not known.

        `unplug` and `plug` the cable; `stuck`, `overload`, `lose` or `heat` a servo by its number; `late`
        answers, by some seconds; `clear` all faults, after which an overloaded servo stays limp; `where`
        returns the time and each position.
        """
        line = line.strip()
        word, _, rest = line.partition(" ")
        with self._lock:
            self._go_on()
            match word:
                case "unplug":
                    self._unplug()
                case "plug":
                    self._plug()
                case "late" if rest.replace(".", "", 1).isdigit():
                    self._late = float(rest)
                case "clear":
                    self._late = 0.0
                    for servo in self._servos.values():
                        servo.stuck = servo.lost = servo.overload = False
                        servo.temperature = 35
                case "where":
                    places = (f"{servo.position:.4f}" for servo in self._servos.values())
                    return f"{time.monotonic():.4f} {' '.join(places)}"
                case "stuck" | "overload" | "lose" | "heat" if rest.isdigit() and int(rest) in self._servos:
                    servo = self._servos[int(rest)]
                    servo.stuck |= word == "stuck"
                    servo.lost |= word == "lose"
                    servo.temperature += 40 * (word == "heat")
                    if word == "overload":
                        servo.overload, servo.holds = True, False
                case _:
                    raise ValueError(f"{line!r} is not a command of the bus, or of one of its servos")
        return "done"

    def _plug(self) -> None:
        if self._line is None:
            self._line = pty.openpty()
            tty.setraw(self._line[1])
            os.set_blocking(self._line[0], False)
            self.path.unlink(missing_ok=True)
            self.path.symlink_to(os.ttyname(self._line[1]))

    def _unplug(self) -> None:
        line, self._line = self._line, None
        self.path.unlink(missing_ok=True)
        self._received.clear()
        self._answers.clear()
        for end in line or ():
            os.close(end)

    def _run(self) -> None:
        while not self._closing.is_set():
            with self._lock:
                self._go_on()
                if self._line is not None:
                    self._talk(self._line[0])
                line = self._line
            ready = line is not None and select.select([line[0]], [], [], 0.002)[0]
            if line is None or not ready:
                time.sleep(0.001)

    def _talk(self, line: int) -> None:
        with suppress(BlockingIOError):
            self._received += os.read(line, 4096)
        for number, kind, content in unpack(self._received):
            self._heard = time.monotonic()
            self._obey(number, kind, content)
        while self._answers and self._answers[0][0] <= time.monotonic():
            with suppress(BlockingIOError):  # nobody reads: it is lost, as on a wire
                os.write(line, self._answers.popleft()[1])

    def _obey(self, number: int, kind: bytes, content: bytes) -> None:
        if kind == b"R":
            due = time.monotonic() + self._late
            for place, servo in self._servos.items():
                if not servo.lost:
                    torque = 1.0 if servo.stuck and servo.holds else 0.0
                    state = (servo.position, servo.velocity, torque, servo.temperature)
                    answer = ANSWER.pack(place, *state, servo.holds, servo.overload)
                    self._answers.append((due, pack(number, b"A", answer)))
        elif kind == b"M":
            for place, setpoint in SETPOINT.iter_unpack(content):
                if place in self._servos and not self._servos[place].lost and self._servos[place].holds:
                    self._servos[place].goal = setpoint
        elif kind == b"T":
            for place, holds in HOLD.iter_unpack(content):
                if place in self._servos and not self._servos[place].lost:
                    servo = self._servos[place]
                    servo.holds, servo.goal = holds and not servo.overload, servo.position

    def _go_on(self) -> None:
        """Move the servos up to now, or until the watchdog holds them."""
        now = time.monotonic()
        until = min(now, self._heard + WATCHDOG)
        for servo in self._servos.values():
            servo.move(max(0.0, until - self._moved))
            if until < now:
                servo.goal, servo.velocity = servo.position, 0.0
        self._moved = now


app = typer.Typer(add_completion=False)


@app.command()
def sim_bus(
    path: Annotated[Path, typer.Argument(metavar="PATH", help="Where the link to its terminal is made.")],
    *,
    servos: Annotated[int, typer.Option(min=1, max=250, help="How many servos it has.")] = 4,
) -> None:
    """Be a bus of servos until Ctrl-C; take commands such as `stuck 2` or `unplug` from standard input."""
    bus = SimBus(servos, path)
    typer.echo(f"ready: {bus.path}")
    for line in sys.stdin:
        try:
            typer.echo(bus.command(line))
        except ValueError as error:
            typer.echo(f"{error}")
    threading.Event().wait()


if __name__ == "__main__":
    app()
