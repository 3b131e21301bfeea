"""A reader of docs/ who types the commands of a page: which they are, and what they write."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import time
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Final, Self

from tests.support.limits import EVENT_LIMIT, FOREVER
from tests.support.ports import free_port
from tests.support.processes import ComponentProcess, free_endpoint

__all__ = ["Command", "Reader", "commands_of", "matches"]

PROGRAMS: Final = frozenset(
    {
        *("ballmover", "codegen", "nao", "naoserver-naoqi", "naoserver-ros2", "naoserver-sim", "visualhfsm"),
        *(".", "cd", "export", "make", "mkdir", "pip", "pytest", "python", "python3", "sed"),
        *("ros2", "zenohd"),
    }
)
"""The first words of commands: blocks of plain text with others are no commands."""
LASTING: Final = {
    r"visualhfsm$": r"https?://",
    r"visualhfsm edit": r"https?://",
    r"naoserver-(sim|ros2)": r"^ready",
    r"python -m naoserver": r"^ready",
    r"nao router": r"^the router listens",
    r"nao stack ros": r"gateway.*ready",
    r"nao stack \./stack\.toml$": r"s  (left|right)|is ready after",
    r"ballmover": "",
    r"python server\.py --listen": r"^ready",
    r"python \w+\.py --listen": "",
}
"""Commands that go on until Ctrl-C, each with the line that a reader waits for."""
ENDED: Final = {r"python (behaviors/|\w+\.py --(near|ros))(?!.*--seconds)": " --seconds 1"}
"""Commands that would go on for long, each with what ends them."""
SERVERS: Final = r"(naoserver-sim|python -m naoserver|nao router)(?!.*--(config|mode client))"
"""Commands that listen on the port to which all others connect."""
STACK: Final = r"nao stack ros"
"""What starts such a command, with its port."""
PORT: Final = "tcp/127.0.0.1:7447"


@dataclass(frozen=True)
class Command:
    """A command of a page, and what it writes, blank where the page does not say."""

    text: str
    output: str = ""


def commands_of(block: str, language: str) -> list[Command]:
    """Return the commands of a block of code: those after `$ `, or its lines."""
    if language == "console" and block.startswith("$ "):
        parts = (part.partition("\n") for part in re.split(r"^\$ ", block, flags=re.M)[1:])
        return [Command(_without_comment(line), output.rstrip()) for line, _, output in parts]
    if language not in ("", "sh", "console"):
        return []
    lines = [_without_comment(line) for line in block.splitlines()]
    return [Command(line) for line in lines] if lines[0].split()[0] in PROGRAMS else []


def _without_comment(line: str) -> str:
    return re.sub(r"\s+# .*", "", line)


def matches(expected: str, output: str) -> bool:
    """Return whether an output is as expected; three dots match anything, and spaces any number of them."""
    pieces = (r"\s+".join(map(re.escape, piece.split(" "))) for piece in expected.split("..."))
    return re.fullmatch(".*".join(pieces), output, re.S) is not None


class Reader:
    """Types commands in a terminal, and starts those that last in others; leaving the block ends them by Ctrl-C.

    Only ports and hosts are exchanged, for some that nobody else uses meanwhile.
    """

    def __init__(self, folder: Path, programs: Path | None = None) -> None:
        self.folder = folder
        self._endpoint = free_endpoint()
        others = [free_port() for _ in range(4)]
        self._exchanged = {
            PORT: self._endpoint,
            "tcp/127.0.0.1:7448": f"tcp/127.0.0.1:{others[0]}",
            "127.0.0.1:9559": f"127.0.0.1:{others[1]}",
            "robotlab.local": "127.0.0.1",
        }
        self._added = {
            "nao stack": f" --set endpoint={self._endpoint}",
            "nao stack ros": f" --set ros={self._endpoint}",
            "nao security init": f" --port {others[2]} --operator-port {others[3]}",
            "nao router --config": "".join(f" --listen tls/127.0.0.1:{port}" for port in others[2:]),
        }
        kept = {key: value for key, value in os.environ.items() if not key.startswith(("PYTHON", "PYTEST"))}
        self._environment = {**kept, "COLUMNS": "80", "BROWSER": "true"}
        self._processes: list[ComponentProcess] = []
        self._started = ExitStack()
        self._server = self._started.enter_context(ExitStack())
        if programs is not None:
            self.activate(programs)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._started.__exit__(kind, error, trace)
        assert [process.output for process in self._processes if "Traceback" in process.output] == []

    def activate(self, programs: Path) -> None:
        """Do what the script `activate` in a folder of programs does."""
        assert (programs / "activate").is_file(), programs
        self._environment["PATH"] = f"{programs}{os.pathsep}{os.environ['PATH']}"

    def leave(self) -> None:
        """End the commands that last, by Ctrl-C."""
        self._started.close()
        self._server = self._started.enter_context(ExitStack())

    def save(self, name: str, text: str) -> None:
        """Save a file of the page."""
        (self.folder / name).write_text(text.replace(PORT, self._endpoint), "utf-8")

    def type(self, command: Command, *, code: int = 0) -> None:
        """Type a command, and compare what it writes; it ends with `code` if the page does not say what it writes."""
        first, _, rest = command.text.partition(" ")
        if first == ".":
            self.activate(self.folder / Path(rest).parent)
        elif first == "cd":
            self.folder /= rest
        elif (
            ready := next((LASTING[each] for each in LASTING if re.match(each, command.text)), None)
        ) is not None:
            self._start(command, ready)
        elif command.text.endswith(" &"):
            self._start(command, "")
        else:
            self._run(command, code)

    def _start(self, command: Command, ready: str) -> None:
        text = self._exchange(command.text.removesuffix(" &"))
        process = ComponentProcess(shlex.split(text), self._settings(text), self.folder)
        self._processes.append(process)
        if re.match(f"{SERVERS}|{STACK}", text):
            self._server.close()  # the page shows another way to start it
            self._server.enter_context(process)
        else:
            self._started.enter_context(process)
        for line in (command.output or ready).splitlines():
            process.wait_for(re.escape(self._exchange(line)) if command.output else line)

    def _run(self, command: Command, code: int) -> None:
        text = self._exchange(command.text)
        deadline = time.monotonic() + EVENT_LIMIT
        while True:
            ended, printed = self._end(text)
            if not command.output:
                assert ended == code, f"{text}\n{printed}"
                return
            written = re.sub(r"^\[[WI]\] .*\n", "", printed, flags=re.M)  # of libqi
            if matches(command.output, written.rstrip()):
                return
            # A reader types more slowly: what was started in the background goes on in between.
            assert " why " in text, f"{text}\n{printed}"
            assert time.monotonic() < deadline, f"{text}\n{printed}"

    def _end(self, text: str) -> tuple[int, str]:
        """Run a command to its end; return its exit code, and what it has written."""
        done = subprocess.run(
            text,
            shell=True,
            cwd=self.folder,
            env=self._settings(text),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=FOREVER,
            check=False,
        )
        return done.returncode, done.stdout

    def _exchange(self, text: str) -> str:
        for known, own in self._exchanged.items():
            text = text.replace(known, own)
        added = (own for start, own in {**self._added, **ENDED}.items() if re.match(start, text))
        return text + "".join(added)

    def _settings(self, text: str) -> dict[str, str]:
        if "--config" in text:
            return self._environment
        kind = "LISTEN" if re.match(SERVERS, text) else "CONNECT"
        return {**self._environment, f"VISUALHFSM_{kind}": self._endpoint}
