"""What benchmarks share: how they read their options, and figures of processes."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Collection, Mapping, Sequence

import psutil

__all__ = ["options", "parts", "percentile", "used"]


def options(description: str | None, **defaults: object) -> argparse.Namespace:
    """Return the options of the command line, which have the types of their defaults."""
    return _parser(description, defaults).parse_args()


def parts(
    description: str | None,
    measured: Mapping[str, Callable[[argparse.Namespace], object]],
    *,
    on_request: Collection[str] = (),
    **defaults: object,
) -> list[object]:
    """Measure the parts that the command line names, or else all but some; return what they return."""
    parser = _parser(description, defaults)
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"of {', '.join(measured)}")
    given = parser.parse_args()
    if unknown := [name for name in given.parts if name not in measured]:
        parser.error(f"there is no part {', '.join(unknown)}; there are {', '.join(measured)}")
    chosen = given.parts or [name for name in measured if name not in on_request]
    return [measured[name](given) for name in chosen]


def _parser(description: str | None, defaults: Mapping[str, object]) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        description=description, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    for name, default in defaults.items():
        flag = f"--{name.replace('_', '-')}"
        if isinstance(default, bool):
            parser.add_argument(flag, action="store_true")
        else:
            parser.add_argument(flag, type=type(default), default=default, help=f"by default {default}")
    return parser


def percentile(values: Sequence[float], share: float) -> float:
    """Return the value that a share of them does not exceed."""
    return sorted(values)[min(int(share * len(values)), len(values) - 1)]


def used(*processes: psutil.Process) -> float:
    """Return the processor seconds that some processes have used until now."""
    return sum(sum(process.cpu_times()[:2]) for process in processes)
