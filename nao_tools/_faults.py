"""Let parts of a simulated robot fail, and list what fails and what can."""

from __future__ import annotations

import math
from typing import Final, TypeVar

import msgspec
import typer
from rich.table import Table

from nao_tools import NaoError
from nao_tools._connection import find_servant
from nao_tools._dynamic import DynamicProxy
from nao_tools._output import console, print_json
from nao_tools._values import Json
from zenoh_ice import Communicator, initialize
from zenoh_ice.data import typed
from zenoh_ice.data.interface import RETURN_VALUE
from zenoh_ice.settings import Settings

_SERVANT: Final = "Faults"
_OPERATIONS: Final = frozenset(("getKinds", "getFaults", "inject", "heal"))


class _Kind(msgspec.Struct):
    """The fields of `nao::FaultKind`."""

    name: str
    text: str
    unit: str
    least: float
    greatest: float
    usual: float


class _Fault(msgspec.Struct):
    """The fields of `nao::Fault`."""

    part: str
    kind: str
    amount: float
    end: float


class _State(msgspec.Struct):
    """The fields of `nao::FaultState`."""

    time: float
    faults: list[_Fault]


_MOMENT: Final = 0.5
"""Seconds that what lasts no time, as a restart, may take until it is reported."""

T = TypeVar("T")


def faults(settings: Settings, part: str, *, as_json: bool) -> None:
    """Print what fails now and how a part can fail, or how all can. Raises NaoError for an unknown part."""
    with initialize(settings) as communicator:
        proxy = _proxy(communicator)
        kinds = _ask(proxy, dict[str, list[_Kind]], "getKinds")
        state = _ask(proxy, _State, "getFaults")
    if part and part not in kinds:
        raise NaoError(f"there is no part {part!r} that can fail; there are {', '.join(kinds)}")
    shown = {part: kinds[part]} if part else kinds
    if as_json:
        kinds_of: dict[str, Json] = {name: [kind.name for kind in each] for name, each in shown.items()}
        print_json({"faults": [_as_json(fault) for fault in state.faults], "kinds": kinds_of})
        return
    out = console()
    for fault in state.faults:
        out.print(_line(fault, state))
    if not state.faults:
        out.print("nothing was made to fail")
    out.print()
    table = Table(box=None, pad_edge=False)
    for column in ("PART", "KIND", "WHAT HAPPENS", "HOW MUCH") if part else ("PART", "KINDS"):
        table.add_column(column)
    for name, each in shown.items():
        if part:
            for kind in each:
                table.add_row(name, kind.name, kind.text, _amount(kind))
        else:
            table.add_row(name, ", ".join(kind.name for kind in each))
    out.print(table)


def inject(
    settings: Settings, part: str, kind: str, amount: float | None, seconds: float | None, *, as_json: bool
) -> None:
    """Let a part fail, and print the failure. Raises the exceptions of `Faults.inject`."""
    with initialize(settings) as communicator:
        proxy = _proxy(communicator)
        state = _ask(proxy, _State, "getFaults")  # first: a server that hangs answers nothing
        fault = _ask(proxy, _Fault, "inject", part, kind, amount, seconds)
    if as_json:
        print_json(_as_json(fault))
    else:
        typer.echo(_line(fault, state))


def heal(settings: Settings, part: str) -> None:
    """End the failures of a part, or of all. Raises the exceptions of `Faults.heal`."""
    with initialize(settings) as communicator:
        _proxy(communicator).invoke("heal", [part or None])
    typer.echo(f"{part} works again" if part else "all works again")


def _proxy(communicator: Communicator) -> DynamicProxy:
    """Return the servant of the failures. Raises the exceptions of a call where there is none."""
    proxy = find_servant(communicator, _SERVANT)
    if not proxy.interface_operations.keys() >= _OPERATIONS:
        raise NaoError(f"{_SERVANT} is a {proxy.type_id}: it has not {', '.join(sorted(_OPERATIONS))}")
    return proxy


def _ask(proxy: DynamicProxy, kind: type[T], operation: str, *arguments: object) -> T:
    returned = proxy.invoke(operation, arguments)[RETURN_VALUE]
    return typed.convert(returned, kind, from_attributes=True)


def _line(fault: _Fault, state: _State) -> str:
    amount = f" {fault.amount:g}" if fault.amount else ""
    left = fault.end - state.time
    lasts = ", until it is healed" if math.isinf(left) else f", for {left:.1f} s" if left > _MOMENT else ""
    return f"{fault.part} fails: {fault.kind}{amount}{lasts}"


def _amount(kind: _Kind) -> str:
    return f"{kind.least:g} to {kind.greatest:g} {kind.unit}, {kind.usual:g} usually" if kind.unit else ""


def _as_json(fault: _Fault) -> Json:
    end = None if math.isinf(fault.end) else fault.end
    return {"part": fault.part, "kind": fault.kind, "amount": fault.amount, "end": end}
