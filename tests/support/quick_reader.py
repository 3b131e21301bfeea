"""A reader of docs/ in a hurry, who types the commands of a page in this process."""

from __future__ import annotations

import contextlib
import os
import re
import shlex
import sys
from pathlib import Path
from typing import Final
from unittest.mock import patch

from tests.support.commands import run_here
from tests.support.programs import PROGRAMS, app_of, component_app, expand, take
from tests.support.reader import Command, Reader
from tests.support.waiting import until
from visualhfsm._base.errors import VisualHfsmError

__all__ = ["QuickReader"]

RUN_HERE: Final = (
    r"codegen ",
    r"nao (list|describe|call|watch|save-image|status|security) ?(?!.*--config)",
    r"visualhfsm (new|diff|draw|convert|why|force|step|break|set|reload|stop) ",
)
"""Commands of ours that end soon, and need no robot but a fake one."""
RUN_APART: Final = (
    r"sed ",
    r"mkdir ",
    r"python -m naoserver\.(fake|hardware)",
    r"python (\w+_(server|client)|server|test_\w+)\.py",
    r"python patrol\.py --listen",
)
"""Commands that run in separate processes, and cost little."""
WRITTEN: Final = ("--write-body", "--record", "--report", "--out", ">")
"""What stands before the name of a file that a command writes."""
SNAPSHOT: Final = "nao watch Hfsm.patrol.getSnapshot --count 1 --json"
AWAITED: Final = {
    "visualhfsm break patrol rest --if": (SNAPSHOT, r'"steps": "(\d{2,}|[6-9])"'),
    "nao call Hfsm.patrol.sendEvent tired": (SNAPSHOT, r'"id": 1, "state": 1,'),
}
"""What has happened before a reader who types more slowly types a command: a question, and its answer."""
FILE: Final = r"[\w./-]+\.(xml|mcap|toml|idl|py|html|scxml|json5)"


class QuickReader(Reader):
    """Types commands as a reader does, but runs those of ours in this process, and only if they end soon.

    Of others that would take long, the words are checked, and that the files that they read are there.
    """

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        # A tenth of the timeout is waited for servants of which pages say that they are not there.
        self._environment["VISUALHFSM_TIMEOUT"] = "10"
        self._environment["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"

    def activate(self, programs: Path) -> None:
        """Stay in the environment of the tests."""

    def _start(self, command: Command, ready: str) -> None:
        if _is_one_of(RUN_APART, command.text):
            super()._start(command, ready)
        else:
            self._take(self._exchange(command.text.removesuffix(" &")))

    def _run(self, command: Command, code: int) -> None:
        for start, (question, answer) in AWAITED.items():
            if command.text.startswith(start):
                until(lambda: re.search(answer, self._end(self._exchange(question))[1]))  # noqa: B023 - at once
        if _is_one_of(RUN_HERE + RUN_APART, command.text):
            super()._run(command, code)
        else:
            self._take(self._exchange(command.text))

    def _end(self, text: str) -> tuple[int, str]:
        if not _is_one_of(RUN_HERE, text):
            return super()._end(text)
        program, words, target = self._words(text)
        own = {key: value for key, value in self._settings(text).items() if key.startswith("VISUALHFSM_")}
        with patch.dict(os.environ, own):
            done = run_here(
                app_of(program), program, *words, cwd=self.folder, expected=(VisualHfsmError,), columns=80
            )
        if target is not None:
            (self.folder / target).write_text(done.stdout, "utf-8")
        return done.returncode, done.stdout + done.stderr

    def _take(self, text: str) -> None:
        program, words, target = self._words(text)
        self._find_files([*words, *([">", target] if target else [])])
        with contextlib.chdir(self.folder):
            if program in PROGRAMS:
                app = app_of(program)
            elif program == "python":
                file = Path(words.pop(0))
                if "\nclass " not in file.read_text("utf-8"):  # no component: the words are its own affair
                    return
                app = component_app(file.resolve())
            else:
                assert program == "pytest", text
                return
            take(app, program, words)

    def _words(self, text: str) -> tuple[str, list[str], str | None]:
        """Return program, words and the file to which the output goes."""
        text, *targets = re.split(r" > (\S+)$", text)
        text = text.replace("python -m naoserver.fake", "'python -m naoserver.fake'").replace(
            "codegen diff", "'codegen diff'"
        )
        program, *words = shlex.split(text)
        return program, expand(words, self.folder), targets[0] if targets else None

    def _find_files(self, words: list[str]) -> None:
        """Check that the files that a command reads are there, and make those that it would write."""
        for before, word in zip(["", *words], words, strict=False):
            if re.fullmatch(FILE, word):
                if before in WRITTEN:
                    (self.folder / word).touch()
                assert (self.folder / word).exists(), f"{word} is not there"


def _is_one_of(patterns: tuple[str, ...], text: str) -> bool:
    return any(re.match(pattern, text) for pattern in patterns)
