"""Run the component of an agent, each of whose calls stays within the limits of a person.

The process gets the limits in its environment, as JSON. A call beyond them is no call: it raises.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from hfsm_runtime.command import World, make_app
from hfsm_runtime.component import Component, proxies_of
from hfsm_runtime.errors import ComponentError
from hfsm_runtime.plugins import components_in, connect, load_module
from interfaces.jderobot import InvalidValueException
from zenoh_ice import Communicator
from zenoh_ice.application.cli import run
from zenoh_ice.data import typed
from zenoh_ice.objects.proxy import Call

LIMITS: Final = "VISUALHFSM_AGENT_LIMITS"
"""The variable with the identities that may be called, and the largest arguments."""


class _Limited(Call[Any, Any]):
    """An operation whose arguments have largest absolute values, by their names."""

    _most: Mapping[str, float]

    def __call__(self, *args: Any, **kwargs: Any) -> Any:  # noqa: ANN401 - as it is declared
        self._require(args, kwargs)
        return super().__call__(*args, **kwargs)

    def begin(self, *args: Any, **kwargs: Any) -> Any:  # noqa: ANN401
        self._require(args, kwargs)
        return super().begin(*args, **kwargs)

    def _require(self, args: tuple[Any, ...], kwargs: Mapping[str, Any]) -> None:
        names = self._operation.arguments.struct.__struct_fields__
        for name, value in {**dict(zip(names, args, strict=False)), **kwargs}.items():
            if name in self._most and not abs(value) <= self._most[name]:
                raise InvalidValueException(f"agent.toml allows at most {self._most[name]:g} for {name}")


def limit(component: Component, interfaces: frozenset[str], most: Mapping[str, float]) -> None:
    """Put limits on the proxies of a component. Raises ComponentError for a servant that is not allowed."""
    for name, declared in proxies_of(component).items():
        if declared.identity not in interfaces:
            raise ComponentError(f"agent.toml does not allow {declared.identity}")
        proxy = vars(component)[name]
        for operation in proxy.ice_interface.all_operations.values():
            start = f"{declared.identity}.{operation.name}."
            if own := {
                key.removeprefix(start): value for key, value in most.items() if key.startswith(start)
            }:
                call = _Limited(proxy, operation)
                call._most = own
                vars(proxy)[operation.method] = call


def main() -> None:
    """Run the component of a file with the component's command line."""
    interfaces, most = typed.from_json(os.environ.pop(LIMITS), tuple[frozenset[str], dict[str, float]])

    @contextmanager
    def world(realm: Communicator) -> Iterator[World]:
        def connected(component: Component) -> None:
            connect(component, realm)
            limit(component, interfaces, most)

        yield World(realm, connected)

    file = Path(sys.argv[1]).resolve()
    sys.argv[:2] = [str(file)]
    sys.path.insert(0, str(file.parent))
    (found,) = components_in(load_module(file.stem, file, own_builtins=True))
    run(make_app(found, world, lean=True), expected=(ComponentError,))


if __name__ == "__main__":
    main()
