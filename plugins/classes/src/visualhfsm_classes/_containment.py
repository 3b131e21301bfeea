"""The containment of one submission: its trials run as others do, its code where it can harm nothing."""

from __future__ import annotations

import re
import signal
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from types import CellType
from typing import Any, Final, Self

import msgspec

from codegen.files import read_regular
from codegen.hfsm.document import Document
from codegen.logic import read_proofs
from codegen.messages import Message
from hfsm_runtime import Component, Event
from hfsm_runtime.component import parameter_values
from hfsm_runtime.errors import ComponentError, VariablesError
from hfsm_runtime.places import PLACE, texts_of_documents
from hfsm_runtime.virtual import BehaviorFailed
from visualhfsm.simulation import Behavior, DocumentInvalid
from visualhfsm_classes._compile import LARGEST_COMPONENT, LIMIT, READY
from visualhfsm_classes._contained_component import LARGEST_DOCUMENT, Shown, make_component, read_submission
from visualhfsm_classes._errors import ComputerFailed, ComputerTooBusy, GradingError
from visualhfsm_classes._requests import Requests
from visualhfsm_classes._sandbox import Allowance, ContainedError, Sandbox, ended_by, why_not_begun
from visualhfsm_classes._walls import Walls
from visualhfsm_classes.contained import _protocol as protocol
from zenoh_ice import ZenohIceError

_COMPILE_LIMIT: Final = 600.0
"""Wall seconds to compile a document, on a busy computer."""
_LONGEST_ERRORS: Final = 4000  # characters
_MOST_SHOWN: Final = 1 << 20
"""Bytes, encoded, of all variables that a recording shows."""
_NUMBER: Final = re.compile(r"^\[Errno \d+\] ")
"""Python's number before the words of the system."""
_LINE: Final = re.compile(r"\(([^()]+):(\d+)\)$")


class Containment:
    """Run the trials of submissions; use it in a `with` block.

    The judge's process keeps clock, robot, automata and transitions, and the functions that judge. The Python
    of a submission runs in a process for each trial, behind walls: without a network, without files but
    Python and packages, and with limits for all that it uses. A submission is one document, which may import
    those of `files` that stand beside it; of these, links and what is larger than a document are left out.

    `include` are folders with packages of interfaces that exercises add. `hidden` are folders that must not
    be seen even if they are among the installed packages. `seconds` is how long the longest trial lasts by
    the robot's clock: what its code may use grows with that, unless there is an `allowance`. With
    `shows_variables` recordings have the variables, as the submission says that they are. With `unsafe` there
    are no walls. Making it raises SandboxUnavailable where there can be none, and so does entering it.
    """

    def __init__(
        self,
        *,
        files: Sequence[Path] = (),
        include: Sequence[Path] = (),
        hidden: Sequence[Path] = (),
        seconds: float = 0.0,
        allowance: Allowance | None = None,
        shows_variables: bool = False,
        unsafe: bool = False,
    ) -> None:
        self._shows: Final = shows_variables
        self._include: Final = tuple(include)
        self._allowance: Final = allowance or Allowance.for_trial(seconds)
        self._walls: Final = Walls(include, hidden, unsafe=unsafe)
        contents = {file: _content(file) for file in files}
        self._files: Final = {file: content for file, content in contents.items() if content is not None}
        self._folder: TemporaryDirectory[str] | None = None
        self._read: Final[dict[tuple[Path, bytes], _Submission]] = {}
        self._behaviors: Final[list[ContainedBehavior]] = []

    def __enter__(self) -> Self:
        self._walls.check()
        self._folder = TemporaryDirectory(prefix="visualhfsm-grading-")
        return self

    def __exit__(self, *_: object) -> None:
        assert self._folder is not None
        with self._folder:
            for behavior in self._behaviors:
                behavior.end_code()

    def read(self, document: str | Path) -> Document:
        """Return what a document says. Raises DocumentInvalid if it cannot run."""
        return self._submission(Path(document)).document

    def simulate(self, document: str | Path, **options: Any) -> Behavior:  # noqa: ANN401 - those of Behavior
        """Return a behavior in virtual time, as `visualhfsm.simulation.simulate` does; close it.

        Raises DocumentInvalid for a document that cannot run, and BehaviorFailed if its variables fail.
        """
        submission = self._submission(Path(document))
        path = submission.path
        code = _Code(self._walls, self._allowance, submission, shows=self._shows)
        component = make_component(
            submission.document,
            path,
            self._include,
            begin=code.begin,
            ask=code.run,
            shown=code.shown,
            proofs=read_proofs(submission.component),
        )
        behavior = ContainedBehavior(component, code, document=path, **options)
        self._behaviors[:] = [*(each for each in self._behaviors if each.runs_code), behavior]
        return behavior

    def _submission(self, path: Path) -> _Submission:
        """Return a submission, read and compiled once. Raises DocumentInvalid."""
        content = _content(path)
        if content is None:
            raise DocumentInvalid(f"{path.name} is no file of at most {LARGEST_DOCUMENT >> 20} MB")
        key = path, content
        if (known := self._read.get(key)) is not None:
            return known
        assert self._folder is not None, "use it in a `with` block"
        folder = Path(tempfile.mkdtemp(dir=self._folder.name))
        files = {file.name: each for file, each in self._files.items() if file.parent == path.parent}
        files[path.name] = content
        for name, each in files.items():
            (folder / name).write_bytes(each)
        copy = folder / path.name
        document = read_submission(copy)
        known = self._read[key] = _Submission(copy, document, self._compile(path.name, files))
        return known

    def _compile(self, name: str, files: Mapping[str, bytes]) -> str:
        """Compile a document behind walls, and return its component. Raises DocumentInvalid."""
        with (
            self._walls.start(self._walls.compiler, name, *self._walls.include) as started,
            tempfile.TemporaryFile() as written,
            tempfile.TemporaryFile() as errors,
        ):
            command, environment, inherited = started
            try:
                done = subprocess.run(
                    command,
                    input=msgspec.msgpack.encode(files),
                    stdout=written,
                    stderr=errors,
                    env=environment,
                    pass_fds=inherited,
                    timeout=_COMPILE_LIMIT,
                    check=False,
                )
            except subprocess.TimeoutExpired:
                raise ComputerTooBusy.because(
                    "the computer was too busy: {name} was not compiled", name=name
                ) from None
            except OSError as error:
                raise ComputerFailed(f"no process can be started: {error.strerror}") from error
            for file in (written, errors):
                file.seek(0)
            said = errors.read(_LONGEST_ERRORS)
            if written.read(len(READY)) != READY:
                raise ComputerFailed(why_not_begun(done.returncode, said))
            text = written.read(LARGEST_COMPONENT + 1)
            if ended_by(done.returncode) in (signal.SIGXCPU, signal.SIGKILL):
                raise DocumentInvalid(f"{name} takes more than {LIMIT} s to compile")
            if done.returncode or len(text) > LARGEST_COMPONENT:
                words = said.decode("utf-8", "replace").strip()
                raise DocumentInvalid(f"{name} cannot be run:\n{words or 'the compiler failed'}")
            return text.decode("utf-8")


@dataclass(frozen=True, slots=True)
class _Submission:
    path: Path
    """A copy of its document, alone with what it may import."""
    document: Document
    component: str
    """The text of its component."""


class _Code:
    """The code of a submission for one trial: its process, begun when its variables run."""

    def __init__(self, walls: Walls, allowance: Allowance, submission: _Submission, *, shows: bool) -> None:
        self._shows: Final = shows
        self.shown: Final[Shown] = {}
        self._walls: Final = walls
        self._allowance: Final = allowance
        self._submission: Final = submission
        self._sandbox: Sandbox | None = None
        self._requests: Requests | None = None
        self._sizes: Final[dict[tuple[int, str], int]] = {}
        """Bytes of each variable that is shown."""
        self._size = 0
        """Bytes of all of them."""
        self._broken = ""
        """The last words of the sandbox."""
        self._too_busy = False
        self.behavior: Behavior | None = None

    @property
    def broken(self) -> str:
        """Why the process cannot go on, or could not; empty while it can."""
        return self._broken if self._sandbox is None else self._sandbox.broken

    def require_computer(self) -> None:
        """Raise ComputerTooBusy if the process cannot go on because the computer had no time for it.

        Raises ComputerFailed if the computer cannot show what cameras see.
        """
        behavior = self.behavior
        if behavior is not None and behavior.has_robot:
            why = getattr(behavior.robot.device, "blind", "")  # which simulated robots alone have
            if why:
                raise ComputerFailed(why)
        if self._too_busy if self._sandbox is None else self._sandbox.too_busy:
            raise ComputerTooBusy(Message.verbatim(self.broken))

    @property
    def runs(self) -> bool:
        """Whether there is a process."""
        return self._sandbox is not None

    def begin(self, component: Component) -> None:
        """Start the process, and run the variables. Raises ContainedError."""
        assert self.behavior is not None
        sandbox = self._sandbox = Sandbox(self._walls, self._allowance)
        requests = self._requests = Requests(self.behavior, sandbox.ask)
        sandbox.serve = requests.serve
        values: dict[str, Any] = parameter_values(component)
        path, text = self._submission.path, self._submission.component
        begin = protocol.Begin(
            requests.now,
            f"{path.stem}.py",
            text,
            texts_of_documents(text, path.parent),
            self._walls.include,
            values,
            sandbox.limits,
            self._shows,
        )
        sandbox.ask(begin, protocol.Done, "its variables")

    def run(self, part: str, automaton: int, id: int, where: str, event: Event | None) -> bool:
        """Run a piece of code, and return what a condition is. Raises what the code raises."""
        sandbox, now = self._running
        name = "" if event is None else event.name
        data = b"" if event is None or event.data is None else msgspec.json.encode(event.data)
        message = protocol.RunCode(now, automaton, part, id, name, data)
        done = sandbox.ask(message, protocol.Done, where)
        if self._shows:
            for variable, value in sandbox.values(done.variables, where).items():
                self._show(automaton, variable, value)
        return done.value

    def variables(self, automaton: int) -> dict[str, Any]:
        """Return the variables of an automaton, as the submission's process says."""
        sandbox, now = self._running
        where = "its variables"
        answer = sandbox.ask(protocol.ListVariables(now, automaton), protocol.Done, where)
        found = sandbox.values(answer.variables, where)
        return {name: sandbox.value(each, where) for name, each in found.items()}

    @property
    def _running(self) -> tuple[Sandbox, int]:
        """The process, and the time in ns."""
        assert self._sandbox is not None
        assert self._requests is not None
        return self._sandbox, self._requests.now

    def _show(self, automaton: int, name: str, encoded: msgspec.Raw) -> None:
        """Show a variable, if all those that are shown do not take too much memory.

        A byte becomes up to 64 of them, as that of an empty dictionary.
        """
        assert self._sandbox is not None
        size = len(name) + len(encoded)
        total = self._size - self._sizes.get((automaton, name), 0) + size
        if total <= _MOST_SHOWN:
            self._size, self._sizes[automaton, name] = total, size
            self.shown[automaton][name] = CellType(self._sandbox.value(encoded, "its variables"))

    def close(self) -> None:
        """End the process."""
        sandbox, self._sandbox = self._sandbox, None
        if sandbox is not None:
            self._broken, self._too_busy = sandbox.broken, sandbox.too_busy
            sandbox.close()
        if self._requests is not None:
            self._requests.close()


class ContainedBehavior(Behavior):
    """A behavior whose code runs in another process.

    Errors of its code raise BehaviorFailed, and so does all that it must not do. `variables` are what the
    submission says, and marks should not depend on them.
    """

    def __init__(self, component: type[Component], code: _Code, **options: Any) -> None:  # noqa: ANN401
        self._code = code
        code.behavior = self
        try:
            super().__init__(component(), **options)
        except (ContainedError, ComponentError, ZenohIceError) as error:
            broken = code.broken
            try:
                code.require_computer()
            finally:
                code.close()
            cause = error.__cause__ if isinstance(error, VariablesError) else error
            if isinstance(cause, GradingError):
                raise cause from None
            if cause is not error or not isinstance(error, ComponentError) or broken or _where(error):
                raise BehaviorFailed(_in_words(cause, broken)) from error
            raise
        except BaseException:
            code.close()
            raise

    @property
    def runs_code(self) -> bool:
        """Whether the process of its code has not ended."""
        return self._code.runs

    def advance(self, seconds: float) -> None:
        """Run all cycles that fall due in the next `seconds`; raises BehaviorFailed as any behavior does."""
        try:
            super().advance(seconds)
        except BehaviorFailed as failure:
            self._code.require_computer()
            cause = failure.__cause__
            if self._code.broken or _where(cause):
                raise BehaviorFailed(f"{_in_words(cause, self._code.broken)}\n{self.timeline}") from failure
            raise
        except ContainedError as error:  # in a function that a stream calls
            self._code.require_computer()
            raise BehaviorFailed(f"{_in_words(error, self._code.broken)}\n{self.timeline}") from error
        self._code.require_computer()
        if self._code.broken:
            raise BehaviorFailed(f"{self._code.broken}\n{self.timeline}")

    def variables(self, automaton: str | int) -> dict[str, Any]:
        """Return the variables of an automaton by name, as the submission says: plain values, or texts."""
        try:
            return self._code.variables(self.automaton(automaton).automaton.id)
        except ContainedError as error:
            self._code.require_computer()
            raise BehaviorFailed(_in_words(error, self._code.broken)) from error

    def end_code(self) -> None:
        """End the process of its code."""
        self._code.close()

    def close(self) -> None:
        """End the code's process, stop the robot, and release everything."""
        try:
            self._code.close()
        finally:
            super().close()


def _content(path: Path) -> bytes | None:
    """Return the content of a file that a stranger handed in; None for a link, a pipe, or one too large."""
    try:
        content = read_regular(path, LARGEST_DOCUMENT + 1, links=False)
    except OSError:
        return None
    return content if len(content) <= LARGEST_DOCUMENT else None


def _where(error: BaseException | None) -> str:
    """Return which code raised an exception; empty if none of the submission did."""
    return getattr(error, "where", "")


def _in_words(error: BaseException | None, broken: str) -> str:
    """Return why a submission failed."""
    if broken or error is None:
        return broken
    place = getattr(error, PLACE, "")
    line = _LINE.search(place)
    where = _where(error)
    if type(error).__name__ == protocol.PrintedTooMuch.__name__:
        said = str(error)
    else:
        text = _NUMBER.sub("", str(error))
        said = f"its code raised {type(error).__name__}" + (f": {text}," if text else ",")
    said = f"{said} in {where}" if where else said.rstrip(",")
    if line is not None:
        return f"{said}, line {line[2]} of {line[1]}"
    return said + (f"\n  at {place}" if place else "")
