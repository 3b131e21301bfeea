"""Wait for a component to run, with everything imported that components import.

The editor starts this script ahead. It gets at its stdin, as JSON, a component's file with its arguments, and
variables of the environment, and is that component as in a new interpreter. Where that would have imported
other files, which lie beside the component or are newer, the process becomes a new interpreter.
"""

from __future__ import annotations

import sys

if __name__ == "__main__" and not sys.flags.safe_path:
    sys.path.pop(0)  # this folder: that of the component takes its place

import builtins
import importlib
import json
import os
import signal
import time
from importlib.machinery import PathFinder, SourceFileLoader
from pathlib import Path
from types import ModuleType

from zenoh_ice.application import LAUNCHER, begin_loading


def main() -> None:
    """Wait, then be the component; end without a word when stdin ends without one."""
    began, launcher = time.time(), os.environ.get(LAUNCHER, "")
    begin_loading()
    import hfsm_runtime.command  # noqa: F401 - all that a component needs
    from hfsm_runtime.ending import report_abrupt_ends
    from hfsm_runtime.loading import prepare_program
    from zenoh_ice.application.cli import load_transport

    load_transport()
    message = b"".join(iter(lambda: os.read(0, 1 << 16), b""))  # not by `sys.stdin`, which the component gets
    if not message:
        return
    with Path(os.devnull).open("r+b", buffering=0) as nothing:
        os.dup2(nothing.fileno(), 0)
    arguments, variables = json.loads(message)
    os.environ.update(variables)
    sys.argv, sys.orig_argv, file = arguments, [sys.executable, *arguments], arguments[0]
    folder = Path(file).resolve().parent
    if _would_differ(folder, began):
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # as `ChildProcess` does
        os.environ[LAUNCHER] = launcher
        os.execv(sys.executable, sys.orig_argv)  # noqa: S606 - as the editor would start it
    if not sys.flags.safe_path:
        sys.path.insert(0, str(folder))
    importlib.invalidate_caches()
    code = compile(Path(file).read_bytes(), file, "exec", dont_inherit=True)
    program = sys.modules["__main__"] = ModuleType("__main__", code.co_consts[0])
    loader = SourceFileLoader("__main__", file)
    vars(program).update(__file__=file, __cached__=None, __loader__=loader, __builtins__=builtins)
    prepare_program()
    report_abrupt_ends(file)
    try:
        exec(code, vars(program))  # noqa: S102 - the component
    except Exception as error:  # noqa: BLE001 - the interpreter reports all of them so
        trace = error.__traceback__ and error.__traceback__.tb_next  # without this function
        sys.excepthook(type(error), error.with_traceback(trace), trace)
        sys.exit(1)


def _would_differ(folder: Path, since: float) -> bool:
    """Return whether a module would be imported from a folder, or has changed since a wall time in s."""
    beside = {each.name.partition(".")[0] for each in folder.iterdir()} - {"__main__"}
    for name, module in [*sys.modules.items()]:
        file = getattr(module, "__file__", None)
        try:
            if file and Path(file).stat().st_ctime > since:
                return True
        except OSError:
            return True
        first, *others = name.split(".")
        if first in beside:
            found = PathFinder.find_spec(name, [str(folder.joinpath(first, *others).parent)])
            if found is not None and found.origin not in (None, file):  # folders without code merge
                return True
    return False


if __name__ == "__main__":
    main()
