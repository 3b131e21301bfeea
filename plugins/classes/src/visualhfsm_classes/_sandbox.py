"""One process with a submission's code: asked to run pieces of it, and watched meanwhile."""

from __future__ import annotations

import itertools
import math
import os
import signal
import subprocess
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, Final, NoReturn, TypeVar

import msgspec

from hfsm_runtime.places import PLACE
from interfaces import jderobot
from visualhfsm.plugins import explain_signal
from visualhfsm_classes._errors import ComputerFailed, ComputerTooBusy
from visualhfsm_classes._process import CodeProcess
from visualhfsm_classes._walls import Walls
from visualhfsm_classes.contained import _protocol as protocol
from zenoh_ice.data import exceptions, typed
from zenoh_ice.data.exceptions import SystemException
from zenoh_ice.data.text import printable

_MEBIBYTE: Final = 1 << 20
_USUAL_TRIAL: Final = 120.0
"""Seconds of a trial for which `Allowance` is made; a longer one may use more in proportion."""
_END_LIMIT: Final = 5.0
"""Wall seconds for a killed process to be gone."""
_LONGEST_ERRORS: Final = 4000
"""Bytes of what a program says that cannot begin."""
_LOOK_PERIOD: Final = 0.05
"""Wall seconds between two looks at code that runs."""
_ACTIVE: Final = 0.1
"""Code that computes, or waits for a processor, for less than this part of its time waits for something."""
_DEEPEST_NESTING: Final = 10
"""Levels of code that waits for other code."""
_MOST_RECEIVED: Final = 64 << 20
"""Bytes of all its messages in a trial: the judge remembers the calls."""
_LONGEST_REASON: Final = 300
_NO_MESSAGE: Final = "its process sent what is no message (are builtins replaced?), in {where}: {error}"

M = TypeVar("M")


@dataclass(frozen=True, slots=True, kw_only=True)
class Allowance:
    """What the code of one trial of up to 120 s may use."""

    block: float = 5.0
    """Seconds of processor time of one piece of code, or of waiting for what never comes."""
    trial: float = 120.0
    """The same of all pieces together."""
    begin: float = 30.0
    """The same in which its modules load and its variables get their values."""
    delay: float = 12.0
    """The factor by which each may take longer by the wall, on a busy computer."""
    sleep: float = 120.0
    """Seconds of the trial that one piece of code may wait."""
    memory: int = 2048
    """MB of address space, libraries included."""
    file: int = 8
    """MB of the largest file."""
    threads: int = 64
    """Threads, the first one included."""
    output: int = 8
    """Million characters that it prints."""
    data: int = 2048
    """MB of all values that the robot sends it: ten times a second the pictures of two cameras are 600."""
    requests: int = 200_000
    """Calls and other questions."""

    @classmethod
    def for_trial(cls, seconds: float) -> Allowance:
        """Return what a trial that lasts so many s by the robot's clock may use, such as a match."""
        longer, usual = max(1.0, seconds / _USUAL_TRIAL), cls()
        return replace(
            usual,
            trial=longer * usual.trial,
            data=math.ceil(longer * usual.data),
            requests=math.ceil(longer * usual.requests),
        )


class ContainedError(Exception):
    """The submission's code raised an exception; subclasses have its name."""


class SubmissionBroken(ContainedError):
    """The submission's process cannot go on; the text says why."""


class _Piece:
    """A piece of code that runs, and for how many s it may."""

    def __init__(self, number: int, where: str, limit: float) -> None:
        self.number: Final = number
        self.where: Final = where
        self.limit: Final = limit
        self.left = limit
        """Of processor time."""
        self.idle = 0.0
        """By the wall, in which it has neither computed nor waited for a processor."""
        self.waited = 0.0
        """By the wall, in which others waited for it."""
        self.slept = 0.0
        """Of the trial."""


class Sandbox:
    """The process of one trial; `serve`, once it is set, does what its code asks for.

    Making it raises ComputerFailed if no process begins, and ComputerTooBusy if that takes too long. Each
    method raises SubmissionBroken once the process cannot go on; `broken` says why.
    """

    def __init__(self, walls: Walls, allowance: Allowance) -> None:
        self.broken = ""
        self.too_busy = False
        """True if it cannot go on because the computer had no time for it."""
        self.serve: Callable[[Any], protocol.Message] = _nobody
        self._allowance: Final = allowance
        self._encoder: Final = msgspec.msgpack.Encoder()
        self._decode: Final = typed.msgpack_decoder(protocol.ToNear)
        self._decode_values: Final = typed.msgpack_decoder(protocol.Values)
        self._depth = 0
        self._requests = 0
        self._sent = self._received = 0
        self._numbers: Final = itertools.count()
        self._left_of_trial = allowance.trial + allowance.begin
        try:
            with walls.start("-m", "visualhfsm_classes.contained") as (command, environment, files):
                self._process: Final = subprocess.Popen(
                    command,
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    stderr=subprocess.PIPE,  # until it has begun: no place of ours that it could fill
                    env=environment,
                    pass_fds=files,
                    start_new_session=True,
                    bufsize=0,
                )
        except OSError as error:
            raise ComputerFailed(f"no process can be started: {error.strerror}") from error
        self._code: Final = CodeProcess(self._process.pid)
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._pipe: Final = protocol.Pipe(
            self._process.stdout.fileno(), self._process.stdin.fileno(), protocol.LARGEST_REQUEST, waits=False
        )
        self._begin()
        self.limits: Final = (
            protocol.Limits()
            if walls.unsafe
            else protocol.Limits(
                memory=allowance.memory * _MEBIBYTE,
                file=allowance.file * _MEBIBYTE,
                files=64,
                cpu=math.ceil(allowance.trial + allowance.begin),
                threads=allowance.threads,
                output=allowance.output * _MEBIBYTE,
            )
        )

    def ask(self, request: protocol.Message, answer: type[M], where: str) -> M:
        """Return the answer of the submission's process; `where` says in words which of its code runs.

        Code that sleeps waits here, in its own `Coroutine`, while other code is asked. Raises ContainedError,
        or another exception that its code raised.
        """
        if self.broken:
            raise SubmissionBroken(self.broken)
        if self._depth == _DEEPEST_NESTING:
            self._break(f"its code in {where} waits for itself")
        allowance = self._allowance
        limit = allowance.begin if isinstance(request, protocol.Begin) else allowance.block
        piece = _Piece(next(self._numbers), where, limit)
        self._depth += 1
        try:
            found = self._ask(request, answer, piece)
        except protocol.PipeTimeout:
            if self._left_of_trial <= 0:
                self._break(f"its code took more than {allowance.trial:g} s in this trial")
            self._break(f"took more than {limit:g} s in {where}")
        except protocol.MessageTooLarge as error:
            self._break(f"broke off the conversation in {where}: {error}")
        except protocol.PipeError as error:
            self._break(self._why_ended(str(error), where))
        except (msgspec.MsgspecError, RecursionError) as error:
            self._break(_NO_MESSAGE.format(where=where, error=error))
        finally:
            self._depth -= 1
        if isinstance(request, protocol.Begin):
            self._code.find()
        return found

    def values(self, encoded: msgspec.Raw, where: str) -> dict[str, msgspec.Raw]:
        """Return variables that its code has sent, each encoded. Raises SubmissionBroken."""
        if len(encoded) > protocol.LARGEST_VALUES:
            self._break(f"sent variables of {len(encoded)} bytes, in {where}")
        try:
            return self._decode_values(bytes(encoded))
        except (msgspec.MsgspecError, RecursionError) as error:
            self._break(_NO_MESSAGE.format(where=where, error=error))

    def value(self, encoded: msgspec.Raw, where: str) -> Any:  # noqa: ANN401 - whatever MessagePack knows
        """Return a variable that its code has sent. Raises SubmissionBroken."""
        try:
            return typed.from_msgpack(bytes(encoded))
        except (msgspec.MsgspecError, ValueError, RecursionError) as error:
            self._break(_NO_MESSAGE.format(where=where, error=error))

    def close(self) -> None:
        """End the process and everything that it has started."""
        broken, self.broken = self.broken, self.broken or "its process was ended"
        if self._process.poll() is None:
            self._process.kill()  # its parent within the walls ends with it, and all others with that
        try:
            self._process.wait(_END_LIMIT)
        except subprocess.TimeoutExpired:
            self.broken = broken or "its process cannot be ended"
        for file in (self._process.stdin, self._process.stdout):
            if file is not None:
                file.close()

    def _begin(self) -> None:
        """Wait until the program runs, which knows nothing of the submission yet."""
        limit = self._allowance.delay * self._allowance.begin
        self._pipe.until = time.monotonic() + limit
        errors = self._process.stderr
        assert errors is not None
        with errors:
            try:
                if self._pipe.receive() == protocol.READY:
                    return
            except protocol.PipeTimeout:
                self.close()
                raise ComputerTooBusy.because(
                    "the computer was too busy: no program began within {limit} s", limit=f"{limit:g}"
                ) from None
            except protocol.PipeError:
                pass
            self.close()
            os.set_blocking(errors.fileno(), False)
            said = errors.read(_LONGEST_ERRORS) or b""
        raise ComputerFailed(why_not_begun(self._process.returncode, said))

    def _ask(self, request: protocol.Message, answer: type[M], piece: _Piece) -> M:
        where, told = piece.where, ""
        if self._pipe.has_more:
            self._break(f"its process sent what nobody had asked for, before {where}")
        self._send(request, piece)
        while True:
            message = self._receive(piece)
            if isinstance(message, answer):
                return message
            if isinstance(message, protocol.Raised):
                raise protocol.ENDS[told] if message.error == told else _exception(message, where)
            self._requests += 1
            if self._requests > self._allowance.requests:
                self._break(
                    f"made more than {self._allowance.requests} requests in a trial, the last in {where}"
                )
            reply = self._serve(message, piece)
            if isinstance(reply, protocol.Failed) and reply.error in protocol.ENDS:
                told = reply.error
            if self.broken:
                raise protocol.ENDS[told] if told else SubmissionBroken(self.broken)
            self._send(reply, piece)

    def _serve(self, message: object, piece: _Piece) -> protocol.Message:
        """Do what code asks for; what it waits for is time of the robot, in which other code runs."""
        if isinstance(message, protocol.Sleep | protocol.Wait):
            self._check_sleep(
                message.seconds if isinstance(message, protocol.Sleep) else message.timeout, piece
            )
            self._depth -= 1
            try:
                return self.serve(message)
            finally:
                self._depth += 1
        began = time.thread_time()
        reply = self.serve(message)
        self._spend(time.thread_time() - began, piece)
        return reply

    def _check_sleep(self, seconds: float, piece: _Piece) -> None:
        if not seconds >= 0:
            self._break(f"asked to sleep {seconds} s in {piece.where}")
        piece.slept += seconds
        if piece.slept > self._allowance.sleep:
            self._break(f"slept more than {self._allowance.sleep:g} s of the trial in {piece.where}")

    def _send(self, message: protocol.Message, piece: _Piece) -> None:
        data = protocol.NUMBER.pack(piece.number) + self._encoder.encode(message)
        self._sent += len(data)
        if self._sent > self._allowance.data * _MEBIBYTE:
            self._break(f"asked for more than {self._allowance.data} MB of the robot's data")
        self._pipe.until = time.monotonic() + self._allowance.delay * piece.limit
        self._pipe.send(data)

    def _receive(self, piece: _Piece) -> Any:  # noqa: ANN401 - a message
        delayed = None
        while True:
            if min(piece.left, self._left_of_trial) <= 0:
                raise protocol.PipeTimeout
            began = time.monotonic()
            self._pipe.until = began + _LOOK_PERIOD
            try:
                data = self._pipe.receive()
            except protocol.PipeTimeout:
                took, used = time.monotonic() - began, self._code.used()
                before, delayed = delayed, self._code.queued()
                active = used + (delayed - before if before is not None else took)
                self._spend(used, piece)
                self._look(piece, took, active)
            else:
                break
        self._spend(self._code.used(), piece)
        self._received += len(data)
        if self._received > _MOST_RECEIVED:
            self._break(f"sent more than {_MOST_RECEIVED >> 20} MB to the robot")
        return self._decode(data)

    def _look(self, piece: _Piece, took: float, active: float) -> None:
        """Look at code for which others have waited for some time, and let it go on. Raises PipeTimeout."""
        piece.waited += took
        piece.idle = 0.0 if active > _ACTIVE * took else piece.idle + took
        if piece.idle > piece.limit:
            raise protocol.PipeTimeout
        if 0 < self.limits.threads < self._code.threads():
            self._break(f"started more than {self.limits.threads} threads in {piece.where}")
        if piece.waited > self._allowance.delay * piece.limit:
            self.too_busy = True
            self._break(f"the computer was too busy: {piece.where} took {piece.waited:.0f} s")

    def _spend(self, seconds: float, piece: _Piece) -> None:
        piece.left -= seconds
        self._left_of_trial -= seconds

    def _break(self, why: str) -> NoReturn:
        """End the process for a reason. Raises SubmissionBroken."""
        if not self.broken:
            self.broken = why[:_LONGEST_REASON]
            self._process.kill()
        raise SubmissionBroken(self.broken)

    def _why_ended(self, error: str, where: str) -> str:
        try:
            code = self._process.wait(1.0)
        except subprocess.TimeoutExpired:
            return f"broke off the conversation in {where}: {error}"
        number = ended_by(code)
        if number == signal.SIGXCPU:
            return f"used too much time of the processor, in {where}"
        if number in signal.valid_signals():
            return f"its process was killed by {explain_signal(number)} in {where}"
        why = " (are builtins replaced?)" if code == 1 else ""
        return f"its process ended by itself with exit code {code} in {where}{why}"


def ended_by(code: int) -> int:
    """Return the signal that ended a program, which walls report as 128 and more; 0 if none did."""
    return -code if code < 0 else code - 128 if code > 128 else 0


def why_not_begun(code: int, said: bytes) -> str:
    """Return why a program behind walls ended before it got anything of a submission."""
    number = ended_by(code)
    how = f"was ended by {explain_signal(number)}" if number else f"ended with exit code {code}"
    lines = said.decode("utf-8", "replace").strip().splitlines()
    return f"the program that is to run their code {how}" + (f": {printable(lines[-1])}" if lines else "")


def _exception(message: protocol.Raised, where: str) -> Exception:
    """Return what code raised as an exception of the same name, with its place."""
    error = _named(message)
    setattr(error, PLACE, printable(message.place))
    error.where = where  # type: ignore[attr-defined]
    return error


def _nobody(message: object) -> protocol.Message:
    raise SubmissionBroken(f"{type(message).__name__} came before anything else")


def _named(message: protocol.Raised) -> Exception:
    name, text = message.error, printable(message.text)
    known = getattr(exceptions, name, None) or getattr(jderobot, name, None)
    if isinstance(known, type) and issubclass(known, SystemException | jderobot.JderobotException):
        with suppress(TypeError):  # one that has other members is no more than its name here
            return known(*filter(None, (text, message.detail)))
    kind: type[ContainedError] = type(
        name if name.isidentifier() else "Exception", (ContainedError,), {"__module__": __name__}
    )
    return kind(text)
