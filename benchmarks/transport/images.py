"""Calls for images, against Ice with tuned memory."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Final

from .content import LARGE_IMAGE, SMALL_IMAGE
from .figures import Effort, Figure, Section, Table, milliseconds, ratio, spread
from .processes import Lab
from .rounds import timed

SMALL_LIMIT: Final = 1.5
LARGE_LIMIT: Final = 2.0

_CALLS: Final = 60


def measure(package: Path, effort: Effort) -> Section:
    """Measure calls that return the pixels of an image."""
    section = Section("images")
    with Lab(package) as lab:
        workers = {kind: lab.pair(kind)[1][0] for kind in ("ours", "ice")}
        for size in (SMALL_IMAGE, LARGE_IMAGE):
            name = f"{size[0]}x{size[1]}"
            times = timed(
                {
                    kind: partial(worker.do, "call", operation="image", count=_CALLS, size=size)
                    for kind, worker in workers.items()
                },
                effort.rounds(40),
            )
            ours, ice = times["ours"], times["ice"]
            if size == SMALL_IMAGE:
                taken = ratio(ours.medians, ice.medians)
                asked, met = f"within {SMALL_LIMIT} times", taken.median <= SMALL_LIMIT
            else:
                taken = ratio(ice.medians, ours.medians)
                asked, met = f"at least {LARGE_LIMIT:.0f} times faster", taken.median >= LARGE_LIMIT
            measured = f"{taken} times" + ("" if size == SMALL_IMAGE else " faster")
            section.figures.append(Figure(f"{name} image call against Ice", asked, measured, met))
            rows = [
                [label, str(spread([median * 1e3 for median in each.medians])), milliseconds(each.p99)]
                for label, each in (("generated proxy", ours), ("Ice, memory tuned", ice))
            ]
            section.tables.append(Table(f"image of {name}", ["", "p50 ms", "p99 ms"], rows))
            section.plot[name] = {kind: each.median.median for kind, each in times.items()}
    return section
