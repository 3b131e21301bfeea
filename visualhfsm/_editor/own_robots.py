"""A robot of the user's own: taken from a model of the project, looked at, and saved as one of its bodies.

The simulation reads the model, in another process: nothing of it is imported here, and a model that hangs
or swells ends with its process. All methods raise VisualHfsmError.
"""

from __future__ import annotations

import asyncio
import re
import resource
import secrets
import sys
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Final, Literal

import msgspec

from codegen.messages import NO_MESSAGE, Message
from visualhfsm._base.environment import child_environment
from visualhfsm._base.errors import MissingPackageError, VisualHfsmError, WouldOverwriteError
from visualhfsm._base.output_lines import describe_exit
from visualhfsm._document.views import of_page
from visualhfsm._monitor.realm.description import describe
from visualhfsm._processes.bodies import FOLDER
from visualhfsm.project._editing.files import make_folder, read_file, write_file
from visualhfsm.project._root import BODY_SUFFIX, Root
from zenoh_ice.application.child import ChildProcess
from zenoh_ice.data import typed
from zenoh_ice.data.text import printable

_NAME: Final = re.compile(r"\w[\w .\-]{0,59}")
_NOT_OF_NAMES: Final = re.compile(r"[^\w\-]+")
_REPORTED: Final = re.compile(r"^[\w.\-]+: error: (.*)", re.DOTALL | re.MULTILINE)
_AT_LINE: Final = re.compile(r" \(at line (\d+), column \d+\)")
_MOST_OUTPUT: Final = 1 << 16
"""Bytes of its output, and of its errors, that are kept."""
_MOST_NOTES: Final = 60
_LONGEST_NOTE: Final = 400


Described = Annotated[msgspec.Raw, of_page('import("../robot3d/robot-drawing.js").Described')]
"""A robot as the page draws it."""


class OwnRobot(msgspec.Struct, frozen=True, kw_only=True, rename="camel", omit_defaults=True):
    """A body of the user's own: the name and the text of its file, and how the robot is drawn.

    `took` says what in the model was taken for what, and `notes` what else there is to know. A text that does
    not describe a robot has a `problem` instead, in its `line` if that is known.
    """

    name: str
    text: str
    took: list[str] = []
    notes: list[str] = []
    problem: Message = NO_MESSAGE
    line: int = 0
    robot: Described | None = None


class OwnRobots:
    """Reads models below the root of a project, one at a time.

    Each takes `patience` s and an address space of `memory` bytes at most.
    """

    def __init__(self, root: Root, *, patience: float = 60.0, memory: int = 4 << 30) -> None:
        self._root = root
        self._patience = patience
        self._memory = memory
        self._folder = root.directory / FOLDER
        self._busy = asyncio.Lock()

    async def guess(self, path: str) -> OwnRobot:
        """Return the robot for which a URDF, xacro or MJCF is taken, or that of a file of the project."""
        model = self._root.model(path)
        if not model.is_relative_to(self._folder):
            raise VisualHfsmError.because(
                "{path} is not in the folder {folder}: put it there, with its meshes",
                path=path,
                folder=FOLDER,
            )
        if not model.is_file():
            raise VisualHfsmError.because("there is no file {path}", path=path)
        if model.suffix == BODY_SUFFIX and model.parent == self._folder:
            return await self.look(model.stem, read_file(model)[0].decode(errors="replace"))
        name = _NOT_OF_NAMES.sub("_", model.name.partition(".")[0]).strip("_") or "robot"
        draft = self._folder / f".{secrets.token_hex(4)}{BODY_SUFFIX}"  # names the model relative to itself
        try:
            async with self._busy:
                took, problem = await self._run(
                    1, "naoserver_sim", f"--body={model}", f"--write-body={draft}"
                )
            text = "" if problem else draft.read_text("utf-8")
        finally:
            draft.unlink(missing_ok=True)
        if problem:
            text = f"model = {msgspec.json.encode(str(model.relative_to(self._folder))).decode()}\n"
            return OwnRobot(name=name, text=text, problem=problem)
        file = f"{name}{BODY_SUFFIX}"
        found = await self.look(name, text.replace(draft.name, file))
        took = [line.removeprefix(f"{model.name}: ").replace(draft.name, file) for line in took]
        return msgspec.structs.replace(found, took=took)

    async def look(self, name: str, text: str) -> OwnRobot:
        """Return the robot that a text describes, as the file of a name in the folder of robots."""
        file = self._file(name)
        async with self._busy:
            with TemporaryDirectory(prefix="visualhfsm-") as folder:
                draft, described = Path(folder, "text"), Path(folder, "robot")
                draft.write_text(text, "utf-8")
                command = ("naoserver_sim._description", str(described), f"--body={file}", f"--text={draft}")
                notes, problem = await self._run(2, *command)
                if problem:
                    return self._at_fault(name, text, file, problem)
                content = described.read_bytes()
        found = await asyncio.to_thread(_drawn, content)
        return OwnRobot(name=name, text=text, notes=notes, robot=msgspec.Raw(found))

    def save(self, name: str, text: str, *, overwrite: bool) -> str:
        """Write the file of a robot, and return its path; with `overwrite` also over another one."""
        file = self._file(name)
        if file.exists() and not overwrite:
            raise WouldOverwriteError.because("{path} already exists", path=self._root.name(file))
        make_folder(self._folder)
        write_file(file, text.encode())
        return self._root.name(file)

    def _file(self, name: str) -> Path:
        if not _NAME.fullmatch(name):
            raise VisualHfsmError.because(
                "{name} is no name of a file: use letters, digits, - and _", name=printable(name)[:60]
            )
        return self._root.resolve(f"{FOLDER}/{name}{BODY_SUFFIX}")

    def _at_fault(self, name: str, text: str, file: Path, problem: Message) -> OwnRobot:
        """Return a robot with a problem, in the line of its text that the problem names."""
        place = re.match(rf"{re.escape(self._root.name(file))}(?::(\d+))?: (.*)", str(problem), re.DOTALL)
        if place is None:
            return OwnRobot(name=name, text=text, problem=problem)
        line, why = place.groups()
        if not line and (found := _AT_LINE.search(why)):
            line, why = found[1], _AT_LINE.sub("", why)
        return OwnRobot(name=name, text=text, problem=Message.verbatim(why), line=int(line or 0))

    async def _run(self, stream: Literal[1, 2], module: str, *options: str) -> tuple[list[str], Message]:
        """Run a command of the simulation; return the lines of stdout or stderr, or else why it fails."""
        if find_spec("mujoco") is None:
            raise MissingPackageError("MuJoCo", "sim")
        kept = {1: bytearray(), 2: bytearray()}

        def take(descriptor: int, data: bytes) -> None:
            kept[descriptor] += data[: _MOST_OUTPUT - len(kept[descriptor])]

        child = ChildProcess(take)
        with VisualHfsmError.in_place_of(OSError, "{command} cannot be started: {reason}", command=module):
            await child.start(
                [sys.executable, "-P", "-m", module, *options],
                # Nothing is rendered, and threads of a library would take address space.
                {**child_environment(), "MUJOCO_GL": "disable", "OPENBLAS_NUM_THREADS": "1"},
            )
        assert child.pid is not None
        try:
            with suppress(ProcessLookupError):  # it has ended already
                resource.prlimit(child.pid, resource.RLIMIT_AS, (self._memory, self._memory))
            async with asyncio.timeout(self._patience):
                code = await child.wait()
        except TimeoutError:
            return [], Message("reading it took longer than {limit} s", limit=f"{self._patience:g}")
        finally:
            child.kill()
            await child.wait()
        if code == 0:
            return [line for line in self._shown(kept[stream]).splitlines() if line][:_MOST_NOTES], NO_MESSAGE
        if reported := _REPORTED.search(self._shown(kept[2])):
            return [], Message.verbatim(reported[1])
        return [], Message("the model cannot be read: {why}", why=describe_exit(code))

    def _shown(self, output: bytearray) -> str:
        """Return the output of a command with the paths as users know them."""
        text = output.decode(errors="replace").replace(f"{self._root.directory}/", "")
        return "\n".join(printable(line, _LONGEST_NOTE) for line in text.splitlines())


def _drawn(content: bytes) -> bytes:
    """Return the JSON of a robot for the page."""
    found = typed.from_json(content, dict[str, msgspec.Raw])
    return describe(bytes(found["body"]).decode(), bytes(found["looks"]).decode()).page
