"""Stop what a component commands: all of it, or what code commands that failed."""

from __future__ import annotations

import inspect
import logging
from collections import defaultdict, deque
from collections.abc import Callable, Collection, Container, Iterable, Iterator
from concurrent.futures import Future, wait
from functools import lru_cache, partial
from itertools import islice
from types import CellType, CodeType, FunctionType, MethodType
from typing import Any, Final

from zenoh_ice import ObjectPrx, ZenohIceError
from zenoh_ice.objects.proxy import Call

from .component import Component, endpoints_of, proxies_of
from .kinds import kinds_of

_STOP_LIMIT: Final = 1.0
"""The longest wait in wall seconds for the robot's answer to being stopped."""

_MOST_ITEMS: Final = 1000
"""Of a list or a dictionary, in which code may have servants."""

_Cached: Final = type(lru_cache(bool))

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
        kind.stop(component, endpoints_of(component))
    done, late = wait(calls, _STOP_LIMIT)
    for call in done:
        _report_stop(calls[call], call)
    for name in sorted({calls[call] for call in late}):
        _logger.warning("self.%s did not say within %g s that it has stopped", name, _STOP_LIMIT)


def stop_named(component: Component, code: Callable[..., object]) -> None:
    """Begin to stop the servants that code names, and those that functions of the document name for it.

    Nobody waits for their answers; failures are logged.
    """
    names = names_in(component, code)
    _stop_soon(component, names)
    for kind in kinds_of(component).values():
        kind.stop(component, names)


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


def names_in(component: Component, code: Callable[..., object]) -> set[str]:
    """Return the names of attributes that code uses, with those in functions that it names.

    It may use them by another name, which is a variable or an attribute, and any of them by `getattr`.
    """
    attributes, servants = vars(component), _connected(component)
    used = {id(each): name for name, proxy in servants.items() for each in (proxy, *vars(proxy).values())}
    found: set[str] = set()
    compiled = getattr(code, "__code__", code)  # also of what stands for code that runs elsewhere
    new: list[Any] = [code, *getattr(compiled, "co_names", ())]
    seen: set[int] = set()
    for each in new:  # grows
        if isinstance(each, str):
            if each not in found:
                found.add(each)
                new += attributes.get(each), inspect.getattr_static(type(component), each, None)
        elif id(each) not in seen:
            seen.add(id(each))
            if isinstance(each, ObjectPrx | Call) and id(each) in used:
                found.add(used[id(each)])
            new += _consists_of(each, servants)
    return found


def _consists_of(value: Any, servants: Collection[str]) -> Iterable[object]:  # noqa: ANN401 - whatever code has
    """Return what code names, or what holds some holds."""
    kind = type(value)  # to ask the value may run code of the document
    if kind is CodeType:  # also of lambdas, and of loops within brackets
        names = value.co_names
        inner = (each for each in value.co_consts if type(each) is CodeType)
        return (*names, *inner, *(servants if "getattr" in names else ()))  # which may mean any of them
    if kind is FunctionType:
        return (value.__code__, *(cell.cell_contents for cell in value.__closure__ or () if _is_set(cell)))
    if issubclass(kind, staticmethod | classmethod | MethodType):
        return (value.__func__,)
    if issubclass(kind, property):
        return (value.fget,)
    if kind is partial:
        return (value.func, *value.args, *value.keywords.values())
    if kind is _Cached:
        return (value.__wrapped__,)
    if kind in (dict, defaultdict):
        value = value.values()
    elif kind not in (list, tuple, set, frozenset, deque):
        return ()
    return islice((*value,), _MOST_ITEMS)


def _is_set(cell: CellType) -> bool:
    try:
        return cell.cell_contents is not None
    except ValueError:  # nothing has been assigned
        return False


def _stops_of(component: Component) -> Iterator[tuple[str, Call[..., Any], int]]:
    """Yield what stops each connected proxy: its name, the call, and how many arguments that takes."""
    for name, proxy in _connected(component).items():
        for operation in proxy.ice_interface.stop_operations:
            yield name, getattr(proxy, operation.method), len(operation.arguments.fields)


def _connected(component: Component) -> dict[str, ObjectPrx]:
    """Return the connected proxies, by attribute."""
    found = ((name, vars(component).get(name)) for name in proxies_of(component))
    return {name: proxy for name, proxy in found if isinstance(proxy, ObjectPrx)}
