"""Try a component without a robot.

`python -m visualhfsm.simulation._dry_run [--body=BODY] COMPONENT [ITS OPTIONS]`

This is *Try it* of the editor: an execution whose time passes by itself, with the fake robot, and stand-ins
for all other interfaces. They cannot be reached from outside; the monitor is served in the realm, as always,
and beside it the description of the robot, for viewers.
"""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Iterator
from contextlib import closing, contextmanager
from functools import partial
from pathlib import Path
from typing import Any, NoReturn

from hfsm_runtime.command import ComponentWorld, make_app
from hfsm_runtime.component import Component
from hfsm_runtime.debugger.reload import components_in
from hfsm_runtime.ending import report_abrupt_ends
from hfsm_runtime.errors import ComponentError, OnError, OnRefused, exit_code_of
from hfsm_runtime.loading import load_module
from hfsm_runtime.virtual.clock import PacedClock
from hfsm_runtime.virtual.paced import THREAD, PacedExecution
from hfsm_runtime.virtual.world import VirtualWorld
from naoserver.bodies import DEFAULT_BODY
from naoserver.body import Body
from naoserver.errors import RobotError
from naoserver_sim.named_body import named_body
from zenoh_ice import Clock, Communicator
from zenoh_ice.application.cli import run

from ._robot import RobotUnderTest

_BODY = "--body="
_KEPT = 100
"""Events and calls that a dry run remembers, perhaps for hours: its monitor shows neither."""


@contextmanager
def dry_run(realm: Communicator, *, body: Body, **options: Any) -> Iterator[ComponentWorld]:  # noqa: ANN401 - of PacedExecution
    """Serve the fake robot, and stand-ins for what it does not serve, within a `with` block.

    In the `realm` only the robot's description is served, by the name of the component.
    """
    clock = PacedClock()
    with (
        closing(VirtualWorld(clock, stand_ins=True, kept=_KEPT)) as world,
        closing(RobotUnderTest("fake", clock, world.network, body=body)) as robot,
    ):

        def make(
            component: Component,
            _clock: Clock,
            on_error: OnError | None = None,
            on_refused: OnRefused | None = None,
            **_servers_present: object,
        ) -> PacedExecution:
            made = PacedExecution(component, world, on_error=on_error, on_refused=on_refused, **options)
            made.joints = lambda: robot.joints
            adapter = realm.createObjectAdapter("dry run")
            adapter.add(robot.description, f"DryRun.{made.name}")
            adapter.activate()
            return made

        yield ComponentWorld(world.communicator, world.connect, make)


def main(**options: Any) -> NoReturn:  # noqa: ANN401 - of PacedExecution
    """Run the component of a file with the component's command line."""
    body = DEFAULT_BODY
    if len(sys.argv) > 1 and sys.argv[1].startswith(_BODY):
        body = sys.argv.pop(1).removeprefix(_BODY)
    if len(sys.argv) < 2:
        sys.exit("usage: python -m visualhfsm.simulation._dry_run [--body=BODY] COMPONENT [ITS OPTIONS]")
    try:
        described = named_body(body)
    except RobotError as error:
        sys.exit(f"the robot cannot be read: {error}")
    file = Path(sys.argv[1]).resolve()
    sys.argv[:2] = [str(file)]
    sys.path.insert(0, str(file.parent))  # for handwritten code beside it
    report_abrupt_ends(str(file))
    try:
        found = components_in(load_module(file.stem, file, own_builtins=True))
    except ComponentError as error:
        sys.exit(f"{file.name}: error: {error}")
    if len(found) != 1:
        sys.exit(f"{file.name} defines {len(found)} components, not one")
    try:
        app = make_app(found[0], partial(dry_run, body=described, **options), lean=True)
        run(app, expected=(ComponentError,))
    except SystemExit as end:
        if any(thread.name == THREAD for thread in threading.enumerate()):
            # Code hangs there. Python would end its thread in the middle of a greenlet, which crashes.
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(exit_code_of(end))
        raise


if __name__ == "__main__":
    main()
