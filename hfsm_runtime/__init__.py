"""Run components that are trees of automata.

A generated component is a `Component` whose `automaton` returns the structure; `main` is its command line.
`VirtualRun` runs one in virtual time, for tests.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from .loading import add_to_path, load_extension, prepare_program

prepare_program()  # before what takes long to import

from .automaton import Automaton, Event, Input, State, Transition  # noqa: E402
from .component import Component, Parameter, Proxy  # noqa: E402
from .errors import ComponentError  # noqa: E402
from .virtual import VirtualRun, run  # noqa: E402

if TYPE_CHECKING:
    from typing import NoReturn

__all__ = [
    "Automaton",
    "Component",
    "ComponentError",
    "Event",
    "Input",
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


def main(component: type[Component]) -> NoReturn:
    """Run a component from the command line, and exit: see `hfsm_runtime.command`."""
    from .command import main as run_command  # a component in a test needs neither Zenoh nor a command line

    run_command(component)
