"""Joint states at 1 kHz to eight subscribers."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Final

from .figures import Effort, Figure, Section, Table, microseconds, milliseconds, percentile, spread, thinned
from .processes import Lab
from .rounds import Times, interleaved
from .streaming import begin, streamed

SUBSCRIBERS: Final = 8
RATE: Final = 1000.0
P99: Final = 2e-3

_SECONDS: Final = 5.0


def measure(package: Path, effort: Effort) -> Section:
    """Measure losses and latency of a stream of 26 doubles, with a process for each subscriber."""
    count = int(effort.seconds(_SECONDS) * RATE)
    with Lab(package) as lab:
        pairs = {kind: lab.pair(kind, SUBSCRIBERS) for kind in ("ours", "ice")}
        for server, clients in pairs.values():
            begin(server, clients, "joints")
        results = interleaved(
            {kind: partial(streamed, *pair, "joints", count, rate=RATE) for kind, pair in pairs.items()},
            effort.rounds(8),
        )
    late, lost, disordered = {}, {}, {}
    for kind, rounds in results.items():
        late[kind] = Times([[time for each in clients for time in each["latencies"]] for clients in rounds])
        lost[kind] = sum(each["sent"] - each["received"] for clients in rounds for each in clients)
        disordered[kind] = not all(each["in_order"] for clients in rounds for each in clients)
    p99 = percentile(late["ours"].all, 0.99)
    total = count * SUBSCRIBERS * len(results["ours"])
    return Section(
        "joints",
        figures=[
            Figure(
                f"26 doubles at 1 kHz to {SUBSCRIBERS} subscribers: losses",
                "none",
                f"{lost['ours']} of {total}" + (", out of order" if disordered["ours"] else ""),
                not lost["ours"] and not disordered["ours"],
            ),
            Figure(
                f"26 doubles at 1 kHz to {SUBSCRIBERS} subscribers: p99",
                f"under {P99 * 1e3:.0f} ms",
                f"{milliseconds(p99)} ms",
                p99 < P99,
            ),
        ],
        tables=[
            Table(
                f"joint states at 1 kHz to {SUBSCRIBERS} subscribers",
                ["", "latency p50 us", "p99 us", "longest ms", "lost"],
                [
                    [
                        name,
                        str(spread([median * 1e6 for median in late[kind].medians])),
                        microseconds(percentile(late[kind].all, 0.99)),
                        milliseconds(max(late[kind].all)),
                        str(lost[kind]),
                    ]
                    for kind, name in (("ours", "stream"), ("ice", "Ice, oneway push"))
                ],
            )
        ],
        plot={kind: thinned(each.all) for kind, each in late.items()},
    )
