"""Run the component of an agent, each of whose calls stays within the limits of a person.

The process gets the limits in its environment, as JSON. A call beyond them is no call: it raises.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import reduce
from pathlib import Path
from typing import Any, Final

from hfsm_runtime.command import ComponentWorld, make_app
from hfsm_runtime.component import Component, proxies_of
from hfsm_runtime.errors import ComponentError
from hfsm_runtime.plugins import components_in, connect, load_module
from interfaces.jderobot import InvalidValueException
from zenoh_ice import Communicator, SystemException
from zenoh_ice.application.cli import run
from zenoh_ice.data import typed
from zenoh_ice.data.codec import Codec
from zenoh_ice.data.interface import Operation
from zenoh_ice.data.keys import Target
from zenoh_ice.transport import Caller, Outcome

LIMITS: Final = "VISUALHFSM_AGENT_LIMITS"
"""The variable with the identities that may be called, and the largest arguments."""


class _Limited:
    """The caller of an operation; it sends no value beyond a largest absolute one, as it is on the wire."""

    def __init__(self, caller: Caller, arguments: Codec[Any], most: Mapping[str, float]) -> None:
        self.timeout: Final = caller.timeout
        self._caller: Final = caller
        self._arguments: Final = arguments
        self._most: Final = most

    def call(self, payload: bytes) -> Outcome:
        self._require(payload)
        return self._caller.call(payload)

    def begin(
        self, payload: bytes, done: Callable[[Outcome | SystemException], object]
    ) -> Callable[[], object]:
        self._require(payload)
        return self._caller.begin(payload, done)

    def _require(self, payload: bytes) -> None:
        arguments = self._arguments.unpack(payload, "a call")
        for name, most in self._most.items():
            if not abs(reduce(getattr, name.split("."), arguments)) <= most:
                raise InvalidValueException(f"agent.toml allows at most {most:g} for {name}")


def limit(realm: Communicator, interfaces: frozenset[str], most: Mapping[str, float]) -> None:
    """Put limits on all calls that leave a realm, whichever proxy makes them."""
    make = realm.transport.caller

    def caller(target: Target, operation: Operation[..., Any], **options: Any) -> Caller:  # noqa: ANN401
        listed = target.realm == realm.realm and target.identity in interfaces
        if not listed and not operation.name.startswith(("get", "ice_")):  # the runtime asks the robot
            raise InvalidValueException(f"agent.toml does not allow {target.identity}")
        start = f"{target.identity}.{operation.name}."
        own = {key.removeprefix(start): value for key, value in most.items() if key.startswith(start)}
        made = make(target, operation, **options)
        return _Limited(made, operation.arguments, own) if own else made

    vars(realm.transport)["caller"] = caller


def require(component: Component, interfaces: frozenset[str], most: Mapping[str, float]) -> None:
    """Raise ComponentError for a servant that is not allowed, and a limit of what it does not have."""
    for declared in proxies_of(component).values():
        if declared.identity not in interfaces:
            raise ComponentError(f"agent.toml does not allow {declared.identity}")
        operations = declared.type.ice_interface.all_operations
        for key in most:
            identity, operation, name = [*key.split(".", 2), "", ""][:3]
            if identity == declared.identity and (
                operation not in operations
                or name.partition(".")[0] not in operations[operation].arguments.fields
            ):
                raise ComponentError(f"agent.toml limits {key}, which {identity} does not have")


def main() -> None:
    """Run the component of a file with the component's command line."""
    interfaces, most = typed.from_json(os.environ.pop(LIMITS), tuple[frozenset[str], dict[str, float]])

    @contextmanager
    def world(realm: Communicator) -> Iterator[ComponentWorld]:
        limit(realm, interfaces, most)

        def connected(component: Component) -> None:
            require(component, interfaces, most)
            connect(component, realm)

        yield ComponentWorld(realm, connected)

    file = Path(sys.argv[1]).resolve()
    sys.argv[:2] = [str(file)]
    sys.path.insert(0, str(file.parent))
    (found,) = components_in(load_module(file.stem, file, own_builtins=True))
    run(make_app(found, world, lean=True), expected=(ComponentError,))


if __name__ == "__main__":
    main()
