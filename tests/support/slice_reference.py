"""The reference compiler, slice2py of ZeroC, as an oracle."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from tests.support.limits import RUN_LIMIT

AVAILABLE = find_spec("IcePy") is not None

# Compiles each file of a list in a separate process, forked from one that has loaded the compiler: starting
# slice2py for each takes far longer, and in one process a refused file affects the files after it.
_WORKER = """
import IcePy, json, os, signal, sys, tempfile

def compiled(path):
    with tempfile.TemporaryFile() as output:
        child = os.fork()
        if child == 0:
            signal.alarm(10)
            os.dup2(output.fileno(), 1)
            os.dup2(output.fileno(), 2)
            os.chdir(os.path.dirname(path))
            os._exit(int(IcePy.compile(["slice2py", "--output-dir", generated, *options, path])))
        _, status = os.waitpid(child, 0)
        output.seek(0)
        return os.waitstatus_to_exitcode(status), output.read().decode(errors="replace")

paths, options, generated = json.load(sys.stdin)
json.dump([compiled(path) for path in paths], sys.stdout)
"""
_ERROR = re.compile(r"^(?P<path>.*?):(?P<line>\d+): (?!warning:)", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class Verdict:
    """The verdict of a compiler: nothing, or the file name and the line of the first error."""

    error: tuple[str, int] | None = None

    @property
    def accepted(self) -> bool:
        """Whether there is no error."""
        return self.error is None

    def __str__(self) -> str:
        return "ok" if self.error is None else f"{self.error[0]}:{self.error[1]}"


def reference_verdicts(
    paths: Sequence[Path], directory: Path, options: Sequence[str] = ()
) -> list[Verdict | None]:
    """Return the verdicts of slice2py on files with the extension .ice; its output goes to `directory`.

    It allows underscores and names that begin with `ice`, as files in use have them.

    None stands for a file on which it crashed.
    """
    directory.mkdir(parents=True, exist_ok=True)
    options = ["--underscore", "--ice", *options]
    request = json.dumps([[str(path.resolve()) for path in paths], options, str(directory)])
    command = [sys.executable, "-c", _WORKER]
    worker = subprocess.run(
        command, input=request, text=True, check=True, capture_output=True, timeout=RUN_LIMIT
    )
    return [_verdict(status, output) for status, output in json.loads(worker.stdout)]


def _verdict(status: int, output: str) -> Verdict | None:
    if status == 0:
        return Verdict()
    match = _ERROR.search(output)
    return Verdict((Path(match["path"]).name, int(match["line"]))) if status == 1 and match else None
