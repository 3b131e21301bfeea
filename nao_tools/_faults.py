"""Let parts of a simulated robot fail, and list what fails and what can."""

from __future__ import annotations

import math
from typing import Final

import typer
from rich.table import Table

from interfaces.nao import Fault, FaultKind, FaultsPrx, FaultState
from nao_tools import NaoError
from nao_tools._connection import wait_for_servant
from nao_tools._output import console, print_json
from nao_tools._values import Json
from zenoh_ice import Communicator, initialize
from zenoh_ice.settings import Settings

_SERVANT: Final = "Faults"


def faults(settings: Settings, part: str, *, as_json: bool) -> None:
    """Print what fails now and how a part can fail, or how all can. Raises NaoError for an unknown part."""
    with initialize(settings) as communicator:
        proxy = _proxy(communicator)
        kinds, state = proxy.getKinds(), proxy.getFaults()
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
        fault = proxy.inject(part, kind, amount, seconds)
        state = proxy.getFaults()
    if as_json:
        print_json(_as_json(fault))
    else:
        typer.echo(_line(fault, state))


def heal(settings: Settings, part: str) -> None:
    """End the failures of a part, or of all. Raises the exceptions of `Faults.heal`."""
    with initialize(settings) as communicator:
        _proxy(communicator).heal(part or None)
    typer.echo(f"{part} works again" if part else "all works again")


def _proxy(communicator: Communicator) -> FaultsPrx:
    """Return the servant of the failures. Raises the exceptions of a call where there is none."""
    wait_for_servant(communicator, _SERVANT)
    return FaultsPrx.uncheckedCast(communicator.stringToProxy(_SERVANT))


def _line(fault: Fault, state: FaultState) -> str:
    amount = f" {fault.amount:g}" if fault.amount else ""
    left = fault.end - state.time
    lasts = "until it is healed" if math.isinf(left) else f"for {max(left, 0.0):.1f} s"
    return f"{fault.part} fails: {fault.kind}{amount}, {lasts}"


def _amount(kind: FaultKind) -> str:
    return f"{kind.least:g} to {kind.greatest:g} {kind.unit}, {kind.usual:g} usually" if kind.unit else ""


def _as_json(fault: Fault) -> Json:
    end = None if math.isinf(fault.end) else fault.end
    return {"part": fault.part, "kind": fault.kind, "amount": fault.amount, "end": end}
