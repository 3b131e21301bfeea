"""Code that all commands share; this module lets Ctrl-C end a command quietly while its modules load.

Every command imports it before anything else, so it imports as little as possible itself.
"""

from __future__ import annotations

import gc
import os
import signal
import sys
from collections.abc import Iterable
from importlib.machinery import PathFinder
from typing import NoReturn

_TETHER = f"{os.path.dirname(__file__)}/tether.py"  # noqa: PTH120 - pathlib takes time to load

LAUNCHER = "HFSM_LAUNCHER"
"""Variable with the id of the process that starts a command without `tether_command`: it ends with that."""
_INTERRUPTED = 130
_INTERFACES = "interfaces"


def begin_loading(*, with_interfaces: bool = True) -> None:
    """Prepare to import a command: Ctrl-C ends the process at once, and garbage collection is off.

    Imported objects all stay, and checking them takes a tenth of the time. `cli.run` ends both. A command
    `with_interfaces` exits with an error if a user's module hides those of VisualHFSM.
    """
    say_version()
    end_at_ctrl_c()
    if launcher := os.environ.pop(LAUNCHER, ""):
        from zenoh_ice.application.tether import tie_to  # not in a command that a person starts

        tie_to(int(launcher))
    gc.disable()
    if with_interfaces and (problem := hidden_interfaces()):
        program = os.path.basename(sys.argv[0].removesuffix("/__main__.py"))  # noqa: PTH119
        sys.exit(f"{program}: error: {problem}")


def hidden_interfaces(folders: Iterable[str] = ()) -> str:
    """Return which module hides the package `interfaces`, and what to do about it; empty if none does.

    Folders of this name merge, wherever Python finds them, but a module of this name replaces them all. It is
    one where Python looks: for programs that also look in other `folders`, or for this process, where nothing
    hides the package any more once it is loaded.
    """
    folders = [*folders]
    if not folders and _INTERFACES in sys.modules and sys.modules[_INTERFACES].__file__ is None:
        return ""
    found = PathFinder.find_spec(_INTERFACES, [*folders, *sys.path])
    if found is None or found.origin is None:
        return ""
    remedy = "rename it"
    if found.submodule_search_locations is not None:
        remedy = "delete this file, as folders of this name merge without it"
    return f"{found.origin} hides the package {_INTERFACES} of VisualHFSM: {remedy}"


def end_at_ctrl_c() -> None:
    """Let Ctrl-C end the process at once, with exit code 130, until another handler takes its place.

    Nothing is cleaned up, so use it only while there is nothing to clean up.
    """
    signal.signal(signal.SIGINT, lambda _number, _frame: os._exit(_INTERRUPTED))


def say_version() -> None:
    """Print the version of the installed wheel and exit, if the command is `--version`."""
    if sys.argv[1:] == ["--version"]:
        from zenoh_ice.data.status import own_version, program_name

        sys.stdout.write(f"{program_name()} {own_version()}\n")
        sys.exit(0)


def missing_package(error: ModuleNotFoundError, extra: str) -> str:
    """Return what to install for a module that cannot be imported: an extra."""
    return f"{error.name or ''} is not installed; type: pip install 'visualhfsm[{extra}]'"


def end_without(program: str, what: str, lack: str) -> NoReturn:
    """End a program that lacks something to be loaded: with code 1, or with its help if that is asked for."""
    if "--help" in sys.argv[1:]:
        sys.stdout.write(
            f"Usage: {program} [OPTIONS]\n\n{what}\n\nIts options are listed once it can run: {lack}\n"
        )
        sys.exit(0)
    sys.exit(f"{program}: error: {lack}")


def tether_command(place: str = "background") -> list[str]:
    """Return the prefix that makes a command end with this process, in the `foreground` or not."""
    return [sys.executable, "-I", "-S", _TETHER, str(os.getpid()), place]
