"""Read a stack file: which processes make up a stack, and how each is started; docs/how-to/nao.md shows one.

`{speed}` in a command stands for a variable. `python` stands for the interpreter that runs the launcher;
other programs are looked up in its folder first.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path
from signal import SIGINT, SIGTERM
from typing import Annotated, Final, Literal

import msgspec
from msgspec import Meta, Struct
from msgspec.structs import replace

from zenoh_ice import ZenohIceError
from zenoh_ice.application.tether import CANNOT_RUN
from zenoh_ice.data.keys import check_name
from zenoh_ice.data.toml_file import parse_toml, read_text

_VARIABLE: Final = re.compile(r"\{(\w+)\}")
_BEHAVIORS: Final = "behaviors"
_PACKAGE: Final = Path(__file__).parents[1]
STEADY: Final = 60.0  # s after its start from which a failure no longer counts as one in a row
ON_PURPOSE: Final = frozenset({0, 128 + SIGINT, 128 + SIGTERM, -SIGINT, -SIGTERM})  # codes of an orderly end
HOPELESS: Final = frozenset({2, CANNOT_RUN})  # codes after wrong usage, which another start does not change

Name = Annotated[
    str,
    Meta(pattern=r"^[A-Za-z0-9_.-]+\Z", description="it names files: write a-z, A-Z, 0-9, . _ - only"),
]
Command = Annotated[tuple[str, ...], Meta(min_length=1, description="write a program and its arguments")]
Seconds = Annotated[float, Meta(gt=0.0, lt=3600.0, description="write seconds above 0 and below 3600")]


Limit = Annotated[int, Meta(ge=1, le=1000, description="write a whole number from 1 to 1000")]


class StackError(ZenohIceError):
    """A stack file is wrong: the message names the file, the line and the key."""


class ProcessSpec(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """How to start one process of a stack, when it is ready, and how long it may take to stop."""

    name: Name
    command: Command
    environment: dict[str, str] = {}
    ready: str = ""
    """A regular expression that a line of its output matches; without one it is ready at once."""
    ready_timeout: Seconds = 20.0
    stop_timeout: Seconds = 3.0
    after: tuple[str, ...] = ()
    foreground: bool = False
    machines: tuple[Name, ...] = ()
    """Where it runs; without any, on each machine."""
    restart: Literal["never", "on-failure"] = "never"
    restart_limit: Limit = 5
    restart_pause: Seconds = 1.0
    notify: bool = False
    """True if it reports to systemd that it is ready, as our commands that serve do."""
    watchdog: Annotated[float, Meta(ge=0.0, lt=3600.0, description="write seconds from 0, below 3600")] = 0.0
    """Seconds after which systemd ends it unless it reported that it works, as robot servers do; 0: never."""

    def __post_init__(self) -> None:
        try:
            re.compile(self.ready)
        except re.error as error:
            raise ValueError(f"ready is not a regular expression: {error}") from error
        if self.watchdog and not self.notify:
            raise ValueError("`watchdog` needs `notify`: it is for a process that reports to systemd")
        if self.foreground and self.ready:
            raise ValueError("a foreground process writes to the terminal and cannot have `ready`")
        if self.foreground and self.restart != "never":
            raise ValueError("the end of a foreground process ends the stack; it cannot have `restart`")


class Restarts:
    """The restart policy of a process: whether it is started again after an end."""

    def __init__(self, spec: ProcessSpec) -> None:
        self._spec = spec
        self._failures = 0

    def pause_after(self, code: int, ran: float) -> float | None:
        """Return the seconds until the process is to be started again, or None if it is not.

        `code` is its exit code, or minus the number of the signal that ended it; `ran` how long it ran, in s,
        and 0 if it never was ready.
        """
        if self._spec.restart == "never" or code in ON_PURPOSE | HOPELESS:
            return None
        self._failures = 1 if ran >= STEADY else self._failures + 1
        return self._spec.restart_pause if self._failures <= self._spec.restart_limit else None


class Stack(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The processes of a stack in the order of the file, with the variables not yet filled in."""

    name: Name = ""
    log_dir: str = ""
    endpoint: str = ""
    variables: dict[str, str] = {}
    processes: tuple[ProcessSpec, ...] = msgspec.field(name="process", default=())

    def __post_init__(self) -> None:
        if not self.processes:
            raise ValueError("it has no [[process]]")
        names = [process.name for process in self.processes]
        for machine in self.machines or [""]:
            foreground = [each.name for each in self._part(machine) if each.foreground]
            if len(foreground) > 1:
                raise ValueError(f"only one process can be foreground, not {', '.join(foreground)}")
        for number, process in enumerate(self.processes):
            if process.name in names[:number]:
                raise ValueError(f"two processes are named {process.name}")
            where = f"process {process.name}"
            for other in process.after:
                # Order in the file is order of starting, which also rules out circles.
                if other not in names[:number]:
                    below = "stands below it; move it up"
                    wrong = below if other in names else "is not a process of the stack"
                    raise ValueError(f"{where}: after names {other}, which {wrong}")
            for word in (*process.command, *process.environment.values()):
                for variable in _VARIABLE.findall(word):
                    if variable not in self.values:
                        raise ValueError(
                            f"{where}: {word!r} uses the variable {variable}, which [variables] lacks"
                        )

    @property
    def values(self) -> dict[str, str]:
        """The variables with their values, the endpoint and the folder of our behaviors among them."""
        endpoint = {"endpoint": self.endpoint} if self.endpoint else {}
        return {_BEHAVIORS: str(shipped("behaviors")), **self.variables, **endpoint}

    @property
    def machines(self) -> list[str]:
        """The machines that its processes name, in the order of the file."""
        return list(dict.fromkeys(machine for each in self.processes for machine in each.machines))

    def on_machine(self, machine: str) -> Stack:
        """Return the part of the stack that runs on a machine; "" for a stack that names none.

        Nothing waits for processes elsewhere. Raises StackError for a machine that the stack does not name.
        """
        if machine not in (self.machines or [""]):
            known = f"write --machine {' or '.join(self.machines)}" if self.machines else "it has no machines"
            raise StackError(f"{f'there is no machine {machine}' if machine else self.name}: {known}")
        names = {each.name for each in self._part(machine)}
        part = [
            replace(each, after=tuple(name for name in each.after if name in names))
            for each in self._part(machine)
        ]
        return replace(self, processes=tuple(part))

    def _part(self, machine: str) -> list[ProcessSpec]:
        return [each for each in self.processes if not machine or machine in (each.machines or [machine])]

    def in_realm(self, realm: str) -> Stack:
        """Return the stack with its processes in a realm, except those that are given one in the file.

        Raises ConfigurationException for a text that is no realm.
        """
        settings = {"VISUALHFSM_REALM": check_name(realm, "realm")}
        processes = tuple(replace(each, environment=settings | each.environment) for each in self.processes)
        return replace(self, processes=processes)

    def with_variables(self, changes: dict[str, str]) -> tuple[ProcessSpec, ...]:
        """Return the processes with every `{variable}` filled in.

        Raises StackError for a change of a variable that the stack does not have.
        """
        own = self.values.keys() - {_BEHAVIORS}
        for name in changes:
            if name not in own:
                known = ", ".join(sorted(own)) or "none"
                raise StackError(f"there is no variable {name}; its variables: {known}")
        values = self.values | changes

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
    """Read and check a stack file; a missing name, or place for its logs, is derived from the file's name.

    Raises StackError when it cannot be read, is not TOML, has an unknown key, a value of a wrong type, a
    repeated or unknown process, an unknown variable or two foreground processes.
    """
    stack = parse_toml(read_text(path, StackError), Stack, str(path), StackError)
    name = stack.name or re.sub(r"[^A-Za-z0-9_.-]", "-", path.stem)
    return replace(stack, name=name, log_dir=stack.log_dir or f"{name}/logs")


def shipped(folder: str, package: Path = _PACKAGE) -> Path:
    """Return a folder of files that come with us, beside or in the `package`: `behaviors` or `deploy`.

    It stands at the top of a checkout, where people see it, and in the wheel below this package, where no
    folder of the same name can hide it.
    """
    installed = package / "_shipped" / folder
    return installed if installed.is_dir() else package.parent / folder


def stack_path(name: str) -> Path:
    """Return the file of a stack: `name` itself if it is a path, otherwise our stack file of that name.

    Raises StackError when there is no such stack.
    """
    if name.endswith(".toml") or "/" in name:
        return Path(name)
    stacks = shipped("deploy")
    ours = sorted(each.stem for each in stacks.glob("*.toml"))
    if name not in ours:
        raise StackError(f"there is no stack {name}; there is {', '.join(ours)}, or a file such as ./my.toml")
    return stacks / f"{name}.toml"


def program_path(program: str) -> str:
    """Return the program for the first word of a command: our interpreter, or one next to it, if any."""
    if program == "python":
        return sys.executable
    beside = Path(sys.executable).parent / program
    return str(beside) if beside.is_file() else program
