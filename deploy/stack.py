"""Read a stack file: which processes make up a stack, and how each is started.

    name = "demo"
    log_dir = "demo/logs"                       # relative to the working directory
    endpoint = "tcp/127.0.0.1:7447"             # another free port is taken when this one is in use

    [variables]                                 # used as {speed}; changed with --set speed=5
    speed = "1"

    [[process]]
    name = "naoserver"
    command = ["python", "-m", "naoserver_sim", "--listen", "{endpoint}", "--speed", "{speed}"]
    ready = "serving"                           # a regular expression that a line of its output matches
    ready_timeout = 20.0                        # seconds
    stop_timeout = 3.0                          # seconds before a harder signal
    after = []                                  # processes that must be ready before this one starts
    environment = { MUJOCO_GL = "egl" }

    [[process]]
    name = "view"
    command = ["python", "-m", "visualhfsm", "watch"]
    foreground = true                           # at most one: it owns the terminal; its end ends the stack

`python` stands for the interpreter that runs the launcher.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypeVar

__all__ = ["ProcessSpec", "Stack", "StackError", "load_stack"]

_VARIABLE = re.compile(r"\{(\w+)\}")
_T = TypeVar("_T")
_NAME = re.compile(r"[\w.-]+")


class StackError(Exception):
    """A stack file is wrong: the message names the file, the process and the key."""


@dataclass(frozen=True, slots=True)
class ProcessSpec:
    """How one process of a stack is started, when it counts as ready, and how long its end may take."""

    name: str
    command: tuple[str, ...]
    environment: Mapping[str, str] = field(default_factory=dict)
    ready: re.Pattern[str] | None = None
    ready_timeout: float = 20.0
    stop_timeout: float = 3.0
    after: tuple[str, ...] = ()
    foreground: bool = False


@dataclass(frozen=True, slots=True)
class Stack:
    """The processes of a stack in the order of the file, with the variables not yet filled in."""

    path: Path
    name: str
    log_dir: Path
    endpoint: str | None
    variables: Mapping[str, str]
    processes: tuple[ProcessSpec, ...]

    @property
    def foreground(self) -> ProcessSpec | None:
        """The process that owns the terminal, if there is one."""
        return next((process for process in self.processes if process.foreground), None)

    def with_variables(self, changes: Mapping[str, str]) -> tuple[ProcessSpec, ...]:
        """Return the processes with every `{variable}` filled in.

        Raises StackError for a change of a variable that the stack does not have.
        """
        for name in changes:
            if name not in self.variables:
                known = ", ".join(sorted(self.variables)) or "none"
                raise StackError(f"{self.path}: there is no variable {name}; its variables: {known}")
        values = {**self.variables, **changes}

        def fill(text: str) -> str:
            return _VARIABLE.sub(lambda match: values[match[1]], text)

        return tuple(
            replace(
                process,
                command=tuple(fill(word) for word in process.command),
                environment={key: fill(value) for key, value in process.environment.items()},
            )
            for process in self.processes
        )


def load_stack(path: Path) -> Stack:
    """Read and check a stack file.

    Raises StackError when it cannot be read, is not TOML, has an unknown key, a value of a wrong type, a
    repeated or unknown process, an unknown variable or two foreground processes.
    """
    try:
        document = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise StackError(f"{path}: cannot be read: {error.strerror}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise StackError(f"{path}: not TOML: {error}") from error
    table = _Table(str(path), document)
    name = table.text("name", path.stem)
    log_dir = Path(table.text("log_dir", f"{name}/logs"))
    endpoint = table.text("endpoint", "") or None
    variables = table.texts("variables")
    if endpoint:
        variables["endpoint"] = endpoint
    rows = table.take("process", list, [])
    table.finish()
    processes = tuple(
        _process(_Table(f"{path}: process {number}", row)) for number, row in enumerate(rows, 1)
    )
    stack = Stack(path, name, log_dir, endpoint, variables, processes)
    _check(stack)
    return stack


def _process(table: _Table) -> ProcessSpec:
    name = table.text("name")
    if not _NAME.fullmatch(name):
        raise StackError(
            f"{table.where}: name is {name!r}: it names a log file, so letters, digits, . _ - only"
        )
    table.where += f" ({name})"
    command = table.words("command")
    if not command:
        raise StackError(f"{table.where}: command is missing or empty")
    ready = table.text("ready", "")
    try:
        pattern = re.compile(ready) if ready else None
    except re.error as error:
        raise StackError(f"{table.where}: ready is no regular expression: {error}") from error
    spec = ProcessSpec(
        name,
        command,
        table.texts("environment"),
        pattern,
        table.seconds("ready_timeout", 20.0),
        table.seconds("stop_timeout", 3.0),
        table.words("after"),
        table.take("foreground", bool, False),
    )
    table.finish()
    if spec.foreground and spec.ready:
        raise StackError(
            f"{table.where}: a foreground process writes to the terminal and cannot have `ready`"
        )
    return spec


def _check(stack: Stack) -> None:
    names = [process.name for process in stack.processes]
    if not names:
        raise StackError(f"{stack.path}: no [[process]] in it")
    for name in names:
        if names.count(name) > 1:
            raise StackError(f"{stack.path}: two processes are named {name}")
    foreground = [process.name for process in stack.processes if process.foreground]
    if len(foreground) > 1:
        raise StackError(f"{stack.path}: only one process can be foreground, not {', '.join(foreground)}")
    started: list[str] = []
    for process in stack.processes:
        where = f"{stack.path}: process {process.name}"
        for other in process.after:
            if other not in names:
                raise StackError(f"{where}: after names {other}, which is not a process of the stack")
            # Order in the file is order of starting, which also rules out circles.
            if other not in started:
                raise StackError(f"{where}: after names {other}, which stands below it; move it up")
        for word in (*process.command, *process.environment.values()):
            for variable in _VARIABLE.findall(word):
                if variable not in stack.variables:
                    raise StackError(
                        f"{where}: {word!r} uses the variable {variable}, which [variables] lacks"
                    )
        started.append(process.name)


class _Table:
    """One table of a stack file: gives its keys by type and complains about what is left over."""

    def __init__(self, where: str, values: object) -> None:
        self.where = where
        if not isinstance(values, dict):
            raise StackError(f"{where}: a table was expected")
        self._values: dict[str, object] = dict(values)

    def take(self, key: str, kind: type[_T], default: _T | None = None) -> _T:
        """Remove and return a value of one type."""
        value = self._values.pop(key, default)
        if not isinstance(value, kind):
            raise StackError(f"{self.where}: {key} must be a {kind.__name__}, not {value!r}")
        return value

    def text(self, key: str, default: str | None = None) -> str:
        return self.take(key, str, default)

    def seconds(self, key: str, default: float) -> float:
        value = self._values.pop(key, default)
        if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value < 3600:
            raise StackError(f"{self.where}: {key} must be seconds above 0 and below 3600, not {value!r}")
        return float(value)

    def words(self, key: str) -> tuple[str, ...]:
        values = self.take(key, list, [])
        for value in values:
            if not isinstance(value, str):
                raise StackError(f"{self.where}: {key} must be a list of strings, but has {value!r}")
        return tuple(values)

    def texts(self, key: str) -> dict[str, str]:
        values = self.take(key, dict, {})
        for name, value in values.items():
            if not isinstance(value, str):
                raise StackError(f"{self.where}: {key}.{name} must be a string, not {value!r}")
        return dict(values)

    def finish(self) -> None:
        """Raise StackError when the table has a key that nobody took."""
        for key in self._values:
            raise StackError(f"{self.where}: unknown key {key}")
