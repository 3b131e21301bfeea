"""Small calls: over the bare querier, against Ice's twoway, many in flight, and the newest of a stream."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Final

from .figures import Effort, Figure, Section, Table, microseconds, ratio, spread, thinned
from .processes import Lab
from .processor_time import rows, spent
from .rounds import Times, interleaved, timed

OVERHEAD: Final = 15e-6
TIMES_ICE: Final = 3.5
IN_FLIGHT: Final = 16
SHARE_IN_FLIGHT: Final = 0.9
LATEST: Final = 20.0

_CALLS: Final = 300
_FLYING_CALLS: Final = 2000
_STREAM_RATE: Final = 100.0

_NAMES: Final = {
    "socket": "blocking socket",
    "ice": "Ice twoway",
    "bare": "bare Zenoh querier and queryable",
    "bare on ours": "bare querier, our servant",
    "ours": "generated proxy, our servant",
}


def measure(package: Path, effort: Effort) -> Section:
    """Measure calls with four doubles there and back."""
    rounds = effort.rounds(60)
    with Lab(package) as lab:
        _, (floor,) = lab.pair("socket")
        bare_server, (bare,) = lab.pair("bare")
        server, (ours,) = lab.pair("ours")
        (servant,) = lab.clients("bare on ours", lab.pair("ours", 0)[0])
        ice_server, (ice,) = lab.pair("ice")
        callers = {"socket": floor, "bare": bare, "bare on ours": servant, "ours": ours, "ice": ice}
        step = timed(
            {
                name: partial(worker.do, "call", operation="step", count=_CALLS)
                for name, worker in callers.items()
            },
            rounds,
        )
        flying = interleaved(
            {
                name: partial(worker.do, "pipeline", count=_FLYING_CALLS, width=IN_FLIGHT)
                for name, worker in (("ours", ours), ("ice", ice))
            },
            effort.rounds(12),
        )
        processor = interleaved(
            {
                "bare Zenoh": partial(spent, bare_server, bare),
                "zenoh_ice": partial(spent, server, ours),
                "Ice": partial(spent, ice_server, ice),
            },
            effort.rounds(12),
        )
        ours.do("follow", stream="joints")
        server.do("start_sending", stream="joints", rate=_STREAM_RATE)
        state = timed(
            {
                "latest": partial(ours.do, "latest", count=_CALLS * 100),
                "ice": partial(ice.do, "call", operation="joints", count=_CALLS),
            },
            rounds,
        )
        server.do("stop_sending")
    section = _section(step, flying, state)
    section.tables.append(
        Table(
            "processor time of a small call",
            ["", "side", "thread", "us a call"],
            [row for kind, rounds in processor.items() for row in rows(kind, rounds)],
        )
    )
    return section


def _section(step: dict[str, Times], flying: dict[str, list[float]], state: dict[str, Times]) -> Section:
    bare, ours, ice = step["bare"], step["ours"], step["ice"]
    overhead = spread([over - under for over, under in zip(ours.medians, bare.medians, strict=True)])
    times_ice = ratio(ours.medians, ice.medians)
    share = ratio(flying["ours"], flying["ice"])
    faster = ratio(state["ice"].medians, state["latest"].medians)
    calls = [
        [
            label,
            str(_in_us(step[kind])),
            microseconds(step[kind].p99),
            f"{step[kind].median.median / ice.median.median:.2f}",
        ]
        for kind, label in _NAMES.items()
    ]
    return Section(
        "calls",
        figures=[
            Figure(
                "small call, overhead over the bare querier",
                f"at most {OVERHEAD * 1e6:.0f} us",
                f"{microseconds(overhead.median)} us "
                f"({microseconds(overhead.low)} to {microseconds(overhead.high)})",
                overhead.median <= OVERHEAD,
            ),
            Figure(
                "small call against Ice's twoway",
                f"at most {TIMES_ICE} times its median",
                f"{times_ice} times; the bare querier {ratio(bare.medians, ice.medians)}",
                times_ice.median <= TIMES_ICE,
            ),
            Figure(
                f"{IN_FLIGHT} calls in flight against Ice",
                f"at least {SHARE_IN_FLIGHT} of its calls a second",
                f"{share}",
                share.median >= SHARE_IN_FLIGHT,
            ),
            Figure(
                "newest joint state against Ice's call",
                f"at least {LATEST:.0f} times faster",
                f"{faster} times",
                faster.median >= LATEST,
            ),
        ],
        tables=[
            Table("4 doubles there and back", ["", "p50 us", "p99 us", "times Ice"], calls),
            Table(
                f"{IN_FLIGHT} calls in flight from one client",
                ["", "calls a second"],
                [["generated proxy", str(spread(flying["ours"]))], ["Ice", str(spread(flying["ice"]))]],
            ),
            Table(
                "joint state of 26 doubles",
                ["", "p50 us", "p99 us"],
                [
                    [
                        "latest() of a stream of 100 a second",
                        str(_in_us(state["latest"])),
                        microseconds(state["latest"].p99),
                    ],
                    ["Ice twoway", str(_in_us(state["ice"])), microseconds(state["ice"].p99)],
                ],
            ),
        ],
        plot={kind: thinned(step[kind].all) for kind in ("bare", "ours", "ice")},
    )


def _in_us(times: Times) -> object:
    return spread([median * 1e6 for median in times.medians])
