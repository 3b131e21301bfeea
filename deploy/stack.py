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
from pathlib import Path
from typing import Annotated, Final

import msgspec
from msgspec import Meta, Struct

from zenoh_ice import ZenohIceError
from zenoh_ice.toml_file import parse_toml, read_text

__all__ = ["ProcessSpec", "Stack", "StackError", "load_stack"]

_VARIABLE: Final = re.compile(r"\{(\w+)\}")

Name = Annotated[
    str, Meta(pattern=r"^[\w.-]+\Z", description="it names a log file: write letters, digits, . _ - only")
]
Command = Annotated[tuple[str, ...], Meta(min_length=1, description="write a program and its arguments")]
Seconds = Annotated[float, Meta(gt=0.0, lt=3600.0, description="write seconds above 0 and below 3600")]


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

    def __post_init__(self) -> None:
        try:
            re.compile(self.ready)
        except re.error as error:
            raise ValueError(f"ready is not a regular expression: {error}") from error
        if self.foreground and self.ready:
            raise ValueError("a foreground process writes to the terminal and cannot have `ready`")


class Stack(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The processes of a stack in the order of the file, with the variables not yet filled in."""

    name: str = ""
    log_dir: str = ""
    endpoint: str = ""
    variables: dict[str, str] = {}
    processes: tuple[ProcessSpec, ...] = msgspec.field(name="process", default=())

    def __post_init__(self) -> None:
        if not self.processes:
            raise ValueError("it has no [[process]]")
        names = [process.name for process in self.processes]
        foreground = [process.name for process in self.processes if process.foreground]
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
        """The variables with their values, the endpoint among them."""
        return {**self.variables, **({"endpoint": self.endpoint} if self.endpoint else {})}

    def with_variables(self, changes: dict[str, str]) -> tuple[ProcessSpec, ...]:
        """Return the processes with every `{variable}` filled in.

        Raises StackError for a change of a variable that the stack does not have.
        """
        for name in changes:
            if name not in self.values:
                known = ", ".join(sorted(self.values)) or "none"
                raise StackError(f"there is no variable {name}; its variables: {known}")
        values = self.values | changes

        def fill(text: str) -> str:
            return _VARIABLE.sub(lambda match: values[match[1]], text)

        return tuple(
            msgspec.structs.replace(
                process,
                command=tuple(fill(word) for word in process.command),
                environment={key: fill(value) for key, value in process.environment.items()},
            )
            for process in self.processes
        )


def load_stack(path: Path) -> Stack:
    """Read and check a stack file; without a name or a place for its logs it gets them from the file's name.

    Raises StackError when it cannot be read, is not TOML, has an unknown key, a value of a wrong type, a
    repeated or unknown process, an unknown variable or two foreground processes.
    """
    stack = parse_toml(read_text(path, StackError), Stack, str(path), StackError)
    name = stack.name or path.stem
    return msgspec.structs.replace(stack, name=name, log_dir=stack.log_dir or f"{name}/logs")
