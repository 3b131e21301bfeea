"""Run all checks and print what they find."""

from __future__ import annotations

import textwrap
from collections import Counter
from collections.abc import Callable, Iterator
from typing import Final

from deploy.nao.doctor import Finding, Level, fail
from deploy.nao.doctor.installation import check_installation
from deploy.nao.doctor.machine import check_machine
from deploy.nao.doctor.network import check_network
from deploy.nao.output import console, print_json, width
from deploy.nao.values import Json
from zenoh_ice import ZenohIceError
from zenoh_ice.settings import Settings

__all__ = ["examine"]

_COLORS: Final = {Level.OK: "green", Level.NOTE: "cyan", Level.WARNING: "yellow", Level.FAILURE: "bold red"}
_MARGIN: Final = 7


def examine(settings: Settings, *, as_json: bool) -> bool:
    """Print what the checks find; return whether nothing failed."""
    checks: dict[str, Callable[[], Iterator[Finding]]] = {
        "installation": check_installation,
        "machine": check_machine,
        "network": lambda: check_network(settings),
    }
    found: list[Json] = []
    counts: Counter[Level] = Counter()
    for name, check in checks.items():
        if not as_json:
            console().print(name, style="bold")
        for finding in _guarded(name, check):
            counts[finding.level] += 1
            if as_json:
                found.append(
                    {"check": name, "level": finding.level, "text": finding.text, "fix": finding.fix}
                )
            else:
                _print(finding)
    if as_json:
        print_json(found)
    else:
        _print_result(counts)
    return not counts[Level.FAILURE]


def _guarded(name: str, check: Callable[[], Iterator[Finding]]) -> Iterator[Finding]:
    """Yield findings; what keeps a check from going on is one, too."""
    try:
        yield from check()
    except (OSError, ValueError, ZenohIceError) as error:
        yield fail(f"the {name} could not be looked at further: {error}", "fix this first")


def _print(finding: Finding) -> None:
    from rich.text import Text

    first, *others = _wrapped(finding.text)
    level = Text(f"  {finding.level:<4} ", _COLORS[finding.level])
    console().print(level + Text(first))
    fix_style = "dim" if finding.level == Level.NOTE else "bold"
    fix = _wrapped(f"fix: {finding.fix}") if finding.fix else []
    for line, style in (*((each, "") for each in others), *((each, fix_style) for each in fix)):
        console().print(Text(" " * _MARGIN) + Text(line, style))


def _wrapped(text: str) -> list[str]:
    printed = " ".join(text.split())
    return textwrap.wrap(printed, max(20, width() - _MARGIN), break_long_words=False) or [""]


def _print_result(counts: Counter[Level]) -> None:
    if counts[Level.FAILURE]:
        text, style = f"{counts[Level.FAILURE]} failed", "bold red"
    elif counts[Level.WARNING]:
        text, style = "it works, but see the warnings", "yellow"
    else:
        text, style = "all is well", "bold green"
    console().print(text, style=style)
