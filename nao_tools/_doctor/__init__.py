"""Find problems between a robot and its programs, and say how to fix them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from functools import partial
from importlib import import_module
from typing import Final

from nao_tools._doctor.installation import check_installation
from nao_tools._doctor.machine import check_machine, check_robots
from nao_tools._doctor.network import check_network
from nao_tools._output import console, print_json, wrapped
from nao_tools._values import Json
from nao_tools.findings import Finding, Level, fail
from zenoh_ice.data.exceptions import ZenohIceError
from zenoh_ice.data.text import printable
from zenoh_ice.settings import Settings

_COLORS: Final = {Level.OK: "green", Level.NOTE: "cyan", Level.WARNING: "yellow", Level.FAILURE: "bold red"}
_MARGIN: Final = 7


def examine(settings: Settings, *, as_json: bool) -> bool:
    """Print what the checks find; return whether nothing failed."""
    checks: dict[str, Callable[[], Iterator[Finding]]] = {
        "installation": check_installation,
        "machine": check_machine,
        "robots": check_robots,
        "network": partial(_check_network, settings),
    }
    found: list[Json] = []
    counts: Counter[Level] = Counter()
    for name, check in checks.items():
        if not as_json:
            console().print(name, style="bold")
        for finding in _guarded(name, check):
            counts[finding.level] += 1
            found.append({"check": name, **finding._asdict()})
            if not as_json:
                _print(finding)
    if as_json:
        print_json(found)
    elif counts[Level.FAILURE]:
        console().print(f"{counts[Level.FAILURE]} failed", style="bold red")
    elif counts[Level.WARNING]:
        console().print("it works, but see the warnings", style="yellow")
    else:
        console().print("all is well", style="bold green")
    return not counts[Level.FAILURE]


def _check_network(settings: Settings) -> Iterator[Finding]:
    """Yield the findings about the network, if what makes links can be loaded."""
    try:
        import_module("zenoh_ice.carriers.zenoh.session")
    except Exception as error:  # noqa: BLE001 - a file that hides a package raises anything
        yield fail(f"not checked: {type(error).__name__}: {error}", "see what fails above")
        return
    yield from check_network(settings)


def _guarded(name: str, check: Callable[[], Iterator[Finding]]) -> Iterator[Finding]:
    """Yield the findings of a check; an error that ends the check is one, too."""
    try:
        yield from check()
    except (OSError, ValueError, ZenohIceError) as error:
        yield fail(f"the {name} could not be checked further: {error}", "fix this first")


def _print(finding: Finding) -> None:
    line = wrapped(f"  {finding.level:<4} {printable(finding.text)}", _MARGIN)
    line.stylize(_COLORS[finding.level], 0, _MARGIN)
    console().print(line)
    if finding.fix:
        style = "dim" if finding.level == Level.NOTE else "bold"
        console().print(wrapped(f"{' ' * _MARGIN}fix: {printable(finding.fix)}", _MARGIN), style=style)
