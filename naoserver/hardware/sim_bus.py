"""A bus of servos to try a server without hardware, at a pseudo terminal, with faults on command.

It speaks in lines of words. `7 read` is answered by a line of each servo: `7`, its number, its position,
velocity and torque, its temperature in degrees Celsius, 1 if it holds, 1 if it was overloaded.
`move 1 0.5 2 0.1` sends servos to setpoints in rad, `hold 1 1 2 0` lets them hold or go limp. Without a line
for 0.1 s every servo holds where it is: the watchdog of the bus.

`python -m naoserver.hardware.sim_bus bus.tty` takes the commands of `SimBus.command` from its standard input.
"""

from __future__ import annotations

import os
import pty
import sys
import tempfile
import threading
import time
import tty
from collections import deque
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final

import typer

WATCHDOG: Final = 0.1
"""Seconds without a line after which every servo holds where it is."""
_FASTEST: Final = 6.0  # rad/s
_SMOOTHED: Final = 0.02  # s over which a servo measures its velocity


@dataclass
class _Servo:
    position: float = 0.0
    goal: float = 0.0
    velocity: float = 0.0
    holds: bool = False
    overload: bool = False
    stuck: bool = False
    lost: bool = False

    def move(self, seconds: float) -> None:
        way = self.goal - self.position if self.holds and not self.stuck else 0.0
        step = min(max(way, -_FASTEST * seconds), _FASTEST * seconds)
        self.position += step
        if seconds:
            self.velocity += (step / seconds - self.velocity) * min(1.0, seconds / _SMOOTHED)


class SimBus:
    """A bus with servos, numbered from 1, at a pseudo terminal; `path` is a link to it.

    Raises OSError when there is something else than a link at `path`, or no folder for it.
    """

    def __init__(self, servos: int, path: Path | None = None) -> None:
        self._folder = None if path else tempfile.TemporaryDirectory(prefix="sim-bus-")
        self.path: Final = path or Path(self._folder.name if self._folder else "") / "tty"
        self._servos = {str(number + 1): _Servo() for number in range(servos)}
        self._lock = threading.Lock()
        self._line: tuple[int, int] | None = None
        self._late = 0.0
        self._answers: deque[tuple[float, str]] = deque()  # to be sent at a time
        self._heard = self._moved = time.monotonic()
        self._received = b""
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
        """Do what a line says, and return the answer; raises ValueError for one that is not known.

        `unplug` and `plug` the cable; let a servo be `stuck`, `overload` or `lose` it, by its number; answer
        `late`, by some seconds; `clear` all faults, after which an overloaded servo stays limp; `where`
        returns the time and each position.
        """
        word, *rest = line.split() or [""]
        servo = self._servos.get(rest[0]) if rest else None
        with self._lock:
            self._go_on()
            if word == "unplug":
                self._unplug()
            elif word == "plug":
                self._plug()
            elif word == "where":
                places = (f"{each.position:.4f}" for each in self._servos.values())
                return f"{time.monotonic():.4f} {' '.join(places)}"
            elif word == "late" and rest and rest[0].replace(".", "", 1).isdigit():
                self._late = float(rest[0])
            elif word == "clear":
                self._late = 0.0
                for each in self._servos.values():
                    each.stuck = each.lost = each.overload = False
            elif word == "stuck" and servo:
                servo.stuck = True
            elif word == "overload" and servo:
                servo.overload, servo.holds = True, False
            elif word == "lose" and servo:
                servo.lost = True
            else:
                raise ValueError(f"{line.strip()!r} is not a command of the bus, or of one of its servos")
        return "done"

    def _plug(self) -> None:
        if self._line is None:
            self._line = pty.openpty()
            tty.setraw(self._line[1])
            os.set_blocking(self._line[0], False)
            self._remove_link()
            self.path.symlink_to(os.ttyname(self._line[1]))

    def _unplug(self) -> None:
        line, self._line = self._line, None
        self._remove_link()
        self._received = b""
        self._answers.clear()
        for end in line or ():
            os.close(end)

    def _remove_link(self) -> None:
        if self.path.is_symlink():  # never somebody's file
            self.path.unlink()

    def _run(self) -> None:
        while not self._closing.is_set():
            with self._lock:
                self._go_on()
                if self._line is not None:
                    self._talk(self._line[0])
            time.sleep(0.001)

    def _talk(self, line: int) -> None:
        with suppress(BlockingIOError):
            self._received += os.read(line, 4096)
        *lines, self._received = self._received.split(b"\n")
        for each in lines:
            self._heard = time.monotonic()
            with suppress(LookupError, ValueError):  # a damaged line is skipped, as on a wire
                self._obey(each.decode("ascii").split())
        while self._answers and self._answers[0][0] <= time.monotonic():
            with suppress(BlockingIOError):  # nobody reads: it is lost
                os.write(line, self._answers.popleft()[1].encode())

    def _obey(self, words: list[str]) -> None:
        if words[1] == "read":
            due = time.monotonic() + self._late
            for number, servo in self._servos.items():
                state = f"{servo.position:.5f} {servo.velocity:.3f} 0 35 {servo.holds:d} {servo.overload:d}"
                if not servo.lost:
                    self._answers.append((due, f"{words[0]} {number} {state}\n"))
            return
        for number, value in zip(words[1::2], words[2::2], strict=True):
            servo = self._servos[number]
            if words[0] == "move" and servo.holds and not servo.lost:
                servo.goal = float(value)
            elif words[0] == "hold" and not servo.lost:
                servo.holds, servo.goal = value == "1" and not servo.overload, servo.position

    def _go_on(self) -> None:
        """Move the servos up to now, or until the watchdog holds them."""
        now = time.monotonic()
        until = min(now, self._heard + WATCHDOG)
        for servo in self._servos.values():
            servo.move(max(0.0, until - self._moved))
            if until < now:
                servo.goal, servo.velocity = servo.position, 0.0
        self._moved = now


def main(
    path: Annotated[Path, typer.Argument(metavar="PATH", help="Where the link to its terminal is made.")],
    servos: Annotated[int, typer.Option(min=1, help="How many servos it has.")] = 4,
) -> None:
    """Be a bus of servos until Ctrl-C; take commands such as `stuck 2` or `unplug` from standard input."""
    try:
        bus = SimBus(servos, path)
    except OSError as error:
        raise typer.BadParameter(f"{path}: {error.strerror}", param_hint="PATH") from error
    typer.echo(f"ready: {bus.path}")
    for line in sys.stdin:
        try:
            typer.echo(bus.command(line))
        except ValueError as error:
            typer.echo(f"{error}")
    threading.Event().wait()


if __name__ == "__main__":
    typer.run(main)
