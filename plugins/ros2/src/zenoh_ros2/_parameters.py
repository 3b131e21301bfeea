"""Parameters of a node, which `ros2 param` and other nodes read and set."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from zenoh_ice.data.text import encodable, text_of

from ._node import Node
from ._wire import QoS
from .exceptions import MessageError, RosError

Value = bool | int | float | str | list[bool] | list[int] | list[float] | list[str]

_NOT_SET: Final = 0
# The numbers of rcl_interfaces/msg/ParameterType, and the field of a value.
_SCALARS: Final = {
    bool: (1, "bool_value"),
    int: (2, "integer_value"),
    float: (3, "double_value"),
    str: (4, "string_value"),
}
_ARRAYS: Final = {
    bool: (6, "bool_array_value"),
    int: (7, "integer_array_value"),
    float: (8, "double_array_value"),
    str: (9, "string_array_value"),
}
_FIELDS: Final = dict([*_SCALARS.values(), *_ARRAYS.values()])

_logger = logging.getLogger(__name__)


@dataclass(slots=True)
class _Parameter:
    value: Value
    description: str
    read_only: bool
    on_change: Callable[[Any], object] | None
    read: Callable[[], Value] | None

    @property
    def present(self) -> Value:
        """The value that it has now."""
        if self.read is not None:
            self.value = self.read()
        return self.value


class Parameters:
    """The parameters of a node and the services for them."""

    def __init__(self, node: Node) -> None:
        """Serve the parameters of a node, initially none."""
        self._node: Final = node
        self._lock: Final = threading.RLock()
        self._known: dict[str, _Parameter] = {}
        self._events: Final = node.create_publisher(
            "rcl_interfaces/msg/ParameterEvent", "/parameter_events", QoS(depth=1000)
        )
        for name, handler in (
            ("GetParameters", self._get),
            ("GetParameterTypes", self._get_types),
            ("SetParameters", self._set),
            ("SetParametersAtomically", self._set_atomically),
            ("ListParameters", self._list),
            ("DescribeParameters", self._describe),
        ):
            service = "".join(f"_{each.lower()}" if each.isupper() else each for each in name).lstrip("_")
            node.create_service(f"rcl_interfaces/srv/{name}", f"~/{service}", handler)

    def declare(
        self,
        name: str,
        value: Value,
        description: str = "",
        *,
        read_only: bool = False,
        on_change: Callable[[Any], object] | None = None,
        read: Callable[[], Value] | None = None,
    ) -> None:
        """Add a parameter; `on_change` first gets each new value, and raises ValueError to refuse it.

        `read` returns the present value of one that others change, too.
        """
        _kind(value)
        with self._lock:
            self._known[name] = _Parameter(value, description, read_only, on_change, read)
        self._publish("new_parameters", name, value)

    def __getitem__(self, name: str) -> Value:
        """Return the value of a parameter."""
        return self._known[name].present

    def __setitem__(self, name: str, value: Value) -> None:
        """Change a parameter from within, even one that is read-only for others."""
        with self._lock:
            self._known[name].value = value
        self._publish("changed_parameters", name, value)

    def _publish(self, field: str, name: str, value: Value) -> None:
        try:
            self._events.publish(
                stamp=self._node.now(),
                node=self._node.full_name,
                **{field: [{"name": name, "value": _encode(value)}]},
            )
        except RosError as error:
            _logger.debug("parameter %s: %s", name, error)

    def _check(self, parameter: Any) -> tuple[_Parameter | None, Value | None, str]:  # noqa: ANN401
        """Return a parameter, its new value, and why it must not be set."""
        known, value = self._known.get(parameter.name), _decode(parameter.value)
        if known is None:
            return None, None, f"there is no parameter {parameter.name!r}"
        if known.read_only:
            return known, None, f"{parameter.name} is read-only"
        if type(known.value) is float and type(value) is int:
            value = float(value)
        if value is None or _kind(value) != _kind(known.value):
            return (
                known,
                None,
                f"{parameter.name}: a value like {known.value!r} is expected, not {value!r:.60}",
            )
        return known, value, ""

    def _apply(self, name: str, known: _Parameter, value: Value) -> str:
        try:
            if known.on_change is not None:
                known.on_change(value)
        except ValueError as error:
            return f"{name}: {text_of(error)}"
        except BaseException as error:  # as in the handler of a service
            _logger.exception("parameter %s: its change failed", name)
            return f"{name}: its change failed: {type(error).__name__}: {text_of(error)}"
        known.value = value
        self._publish("changed_parameters", name, value)
        return ""

    def _set(self, request: Any) -> object:  # noqa: ANN401
        results = []
        for each in request.parameters:
            with self._lock:
                known, value, why = self._check(each)
                if not why and known is not None and value is not None:
                    why = self._apply(each.name, known, value)
            results.append({"successful": not why, "reason": encodable(why)})
        return {"results": results}

    def _set_atomically(self, request: Any) -> object:  # noqa: ANN401
        with self._lock:
            checked = [(each.name, *self._check(each)) for each in request.parameters]
            why = next((why for *_, why in checked if why), "")
            wanted = [  # with the values before any change: reading one may fail
                (name, known, value, known.present)
                for name, known, value, _ in checked
                if not why and known is not None and value is not None
            ]
            for count, (name, known, value, _) in enumerate(wanted):
                if why := self._apply(name, known, value):
                    for earlier, parameter, _, before in reversed(wanted[:count]):
                        self._apply(earlier, parameter, before)
                    break
        return {"result": {"successful": not why, "reason": encodable(why)}}

    def _get(self, request: Any) -> object:  # noqa: ANN401
        with self._lock:
            found = [self._known.get(name) for name in request.names]
        return {"values": [_encode(each.present) if each else {"type": _NOT_SET} for each in found]}

    def _get_types(self, request: Any) -> object:  # noqa: ANN401
        with self._lock:
            found = [self._known.get(name) for name in request.names]
        return {"types": [_kind(each.value)[0] if each else _NOT_SET for each in found]}

    def _list(self, request: Any) -> object:  # noqa: ANN401
        def wanted(name: str) -> bool:
            beside = [
                name.removeprefix(each + ".") for each in request.prefixes if name.startswith(each + ".")
            ]
            rests = beside if request.prefixes else [name]
            exact = name in request.prefixes
            return exact or any(not request.depth or rest.count(".") < request.depth for rest in rests)

        with self._lock:
            known = [*self._known]
        names = sorted(filter(wanted, known))
        prefixes = sorted({name.rpartition(".")[0] for name in names if "." in name})
        return {"result": {"names": names, "prefixes": prefixes}}

    def _describe(self, request: Any) -> object:  # noqa: ANN401
        described = []
        for name in request.names:
            known = self._known.get(name)
            described.append(
                {
                    "name": name,
                    "type": _kind(known.value)[0],
                    "description": known.description,
                    "read_only": known.read_only,
                }
                if known
                else {"name": name}
            )
        return {"descriptors": described}


def _kind(value: Value) -> tuple[int, str]:
    """Return the number of a value's type, and the field that has it."""
    if isinstance(value, list):
        kinds = {type(each) for each in value} or {str}
        if len(kinds) == 1 and (found := _ARRAYS.get(kinds.pop())):
            return found
    elif found := _SCALARS.get(type(value)):
        return found
    raise MessageError(f"a parameter is a bool, int, float, str or a list of one of them, not {value!r:.60}")


def _encode(value: Value) -> dict[str, object]:
    number, field = _kind(value)
    return {"type": number, field: value}


def _decode(message: Any) -> Value | None:  # noqa: ANN401
    field = _FIELDS.get(message.type)
    if field is None:
        return None
    value = getattr(message, field)
    if isinstance(value, np.ndarray):
        listed: Value = value.tolist()
        return listed
    return value  # type: ignore[no-any-return]
