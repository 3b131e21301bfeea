"""Streams of images: the maximum rate, and the latency at 30 images per second."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any, Final

from .content import LARGE_IMAGE
from .figures import Effort, Figure, Section, Table, milliseconds, percentile, ratio, spread, thinned
from .processes import Lab, Worker
from .rounds import Times, interleaved
from .streaming import begin, streamed

FRAMES: Final = 3.0
LATENCY: Final = 0.6
RATE: Final = 30.0

_AT_MAXIMUM: Final = 400


def measure(package: Path, effort: Effort) -> Section:
    """Measure a stream of 1280x960 images to one subscriber."""
    with Lab(package) as lab:
        pairs = {kind: lab.pair(kind) for kind in ("ours", "ice")}
        for server, clients in pairs.values():
            begin(server, clients, "video", LARGE_IMAGE)
        at_30 = interleaved(
            {kind: partial(_at, pair, int(effort.seconds(4.0) * RATE), RATE) for kind, pair in pairs.items()},
            effort.rounds(8),
        )
        fastest = interleaved(
            {kind: partial(_at, pair, _AT_MAXIMUM, 0.0) for kind, pair in pairs.items()},
            effort.rounds(10),
        )
    return _section(at_30, fastest)


def _at(pair: tuple[Worker, list[Worker]], count: int, rate: float) -> dict[str, Any]:
    (result,) = streamed(*pair, "video", count, rate=rate, size=LARGE_IMAGE)
    return result


def _section(at_30: dict[str, list[dict[str, Any]]], fastest: dict[str, list[dict[str, Any]]]) -> Section:
    late = {kind: Times([each["latencies"] for each in results]) for kind, results in at_30.items()}
    rates = {kind: [each["rate"] for each in results] for kind, results in fastest.items()}
    more = ratio(rates["ours"], rates["ice"])
    earlier = ratio(late["ours"].medians, late["ice"].medians)
    names = {"ours": "stream", "ice": "Ice, oneway push, memory tuned"}
    return Section(
        "streams",
        figures=[
            Figure(
                "1280x960 stream at its maximum against Ice",
                f"at least {FRAMES:.0f} times the frames",
                f"{more} times",
                more.median >= FRAMES,
            ),
            Figure(
                f"its latency at {RATE:.0f} frames/s against Ice",
                f"at most {LATENCY} of it",
                f"{earlier}",
                earlier.median <= LATENCY,
            ),
        ],
        tables=[
            Table(
                "1280x960 at its maximum",
                ["", "frames a second received", "sent a second", "received of those sent"],
                [
                    [
                        name,
                        str(spread(rates[kind])),
                        str(spread([each["sent"] / each["wall"] for each in fastest[kind]])),
                        _received(fastest[kind]),
                    ]
                    for kind, name in names.items()
                ],
            ),
            Table(
                f"1280x960 at {RATE:.0f} frames/s",
                ["", "latency p50 ms", "p99 ms", "received of those sent"],
                [
                    [
                        name,
                        str(spread([median * 1e3 for median in late[kind].medians])),
                        milliseconds(percentile(late[kind].all, 0.99)),
                        _received(at_30[kind]),
                    ]
                    for kind, name in names.items()
                ],
            ),
        ],
        plot={
            "rates": {kind: spread(each).median for kind, each in rates.items()},
            "latencies": {kind: thinned(each.all) for kind, each in late.items()},
        },
    )


def _received(results: list[dict[str, Any]]) -> str:
    return f"{sum(each['received'] for each in results) / sum(each['sent'] for each in results):.1%}"
