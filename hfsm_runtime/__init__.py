"""Run components that are trees of automata.

A generated component is a `Component` whose `automaton` returns the structure; `main` is its command line.
`VirtualRun` runs one in virtual time, for tests.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from zenoh_ice.lazy import import_on_use

from .loading import add_to_path, end_loading, load_extension, prepare_program, program_file

prepare_program()  # before the slow imports

from ._automaton import Automaton, Event, Input, Output, State, Transition  # noqa: E402
from .component import Component, Parameter, Proxy  # noqa: E402
from .ending import report_abrupt_ends  # noqa: E402
from .errors import ComponentError  # noqa: E402

if program_file():
    report_abrupt_ends(program_file())  # before the document's libraries

if TYPE_CHECKING:
    from typing import Any, NoReturn

    from .virtual._run import VirtualRun as VirtualRun
    from .virtual._run import run as run

__all__ = [
    "Automaton",
    "Component",
    "ComponentError",
    "Event",
    "Input",
    "Output",
    "Parameter",
    "Proxy",
    "State",
    "Transition",
    "VirtualRun",
    "add_to_path",
    "load_extension",
    "main",
    "run",
]

_import, __dir__ = import_on_use(__name__)  # for tests


def __getattr__(name: str) -> Any:  # noqa: ANN401
    from .kinds import NAMES, imported  # few components have endpoints

    return imported(name) if name in NAMES else _import(name)


def main(component: type[Component]) -> NoReturn:
    """Run a component from the command line, and exit: see `hfsm_runtime.command`."""
    end_loading()
    from .command import main as run_command  # a component in a test needs neither Zenoh nor a command line

    run_command(component)
