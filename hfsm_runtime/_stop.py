"""Stop what a component commands: all of it, or what nobody commands any more."""

from __future__ import annotations

import logging
from collections.abc import Container, Iterator
from concurrent.futures import Future, wait
from functools import partial
from typing import Any, Final

from zenoh_ice import ObjectPrx, ZenohIceError
from zenoh_ice.objects.proxy import Call

from .component import Component, endpoints_of, proxies_of
from .kinds import kinds_of

_STOP_LIMIT: Final = 1.0
"""The longest wait in wall seconds for the robot's answer to being stopped."""

_logger = logging.getLogger(__name__)


def may_move(component: Component) -> bool:
    """Return whether a component may have the robot move: whether its end stops anything."""
    return bool(endpoints_of(component)) or any(True for _ in _stops_of(component))


def end_callbacks(component: Component) -> None:
    """Call no user code any more with samples of streams: it might command again what is to stop."""
    for proxy in _connected(component).values():
        proxy.ice_endSubscriptions()


def send_only_stops(component: Component) -> None:
    """Let proxies of the component do nothing but stop, whichever thread of user code still has them."""
    for proxy in _connected(component).values():
        proxy.ice_getCommunicator().sends_only_stops = True


def stop_robot(component: Component) -> None:
    """Stop everything that a component may have commanded: call the operations that the IDL marks as stops.

    Endpoints of other kinds stop what they drive. This takes at most 1.5 s; missing answers are logged.
    """
    calls = _begin_stops(component, proxies_of(component))
    for kind in kinds_of(component).values():
        kind.stop(component)
    done, late = wait(calls, _STOP_LIMIT)
    for call in done:
        _report_stop(calls[call], call)
    for name in sorted({calls[call] for call in late}):
        _logger.warning("self.%s did not say within %g s that it has stopped", name, _STOP_LIMIT)


def begin_to_stop_robot(component: Component) -> None:
    """Begin to stop everything that a component may have commanded, since nobody may stop it any more.

    Nobody waits for the answers of servants; failures are logged.
    """
    _stop_soon(component, proxies_of(component))
    for kind in kinds_of(component).values():
        kind.stop(component)


def stop_removed(former: Component, component: Component) -> None:
    """Begin to stop the servants for which a component has no proxies any more, as the former version had."""
    kept = {proxy.ice_toWire() for proxy in _connected(component).values()}
    lost = {name for name, proxy in _connected(former).items() if proxy.ice_toWire() not in kept}
    _stop_soon(former, lost)


def _stop_soon(component: Component, names: Container[str]) -> None:
    for call, name in _begin_stops(component, names).items():
        call.add_done_callback(partial(_report_stop, name))


def _begin_stops(component: Component, names: Container[str]) -> dict[Future[Any], str]:
    """Begin to stop what some proxies command; return the calls, each with the name of its proxy."""
    calls: dict[Future[Any], str] = {}
    for name, stop, parameters in _stops_of(component):
        if name in names:
            try:
                calls[stop.begin(*[None] * parameters)] = name  # every parameter of a stop is optional
            except ZenohIceError as error:
                _logger.warning("self.%s could not be stopped: %s", name, error)
    return calls


def _report_stop(name: str, call: Future[Any]) -> None:
    failure = call.exception()
    if failure is not None:
        _logger.warning("self.%s could not be stopped: %s", name, failure)


def _stops_of(component: Component) -> Iterator[tuple[str, Call[..., Any], int]]:
    """Yield what stops each connected proxy: its name, the call, and how many arguments that takes."""
    for name, proxy in _connected(component).items():
        for operation in proxy.ice_interface.stop_operations:
            yield name, getattr(proxy, operation.method), len(operation.arguments.fields)


def _connected(component: Component) -> dict[str, ObjectPrx]:
    """Return the connected proxies, by attribute."""
    found = ((name, vars(component).get(name)) for name in proxies_of(component))
    return {name: proxy for name, proxy in found if isinstance(proxy, ObjectPrx)}
