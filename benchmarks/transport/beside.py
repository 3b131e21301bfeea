"""Small calls of a client that follows a stream of images, and small calls while a simulated robot runs."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Final

from tests.support.processes import ComponentProcess, free_endpoint, module

from .content import LARGE_IMAGE
from .figures import Effort, Figure, Section, Table, microseconds, milliseconds, percentile, ratio, spread
from .processes import Lab, Worker
from .rounds import timed
from .streaming import begin

P99: Final = 1.5e-3
RATE: Final = 30.0
TIMES_ICE: Final = 2.5

_SECONDS: Final = 4.0


def measure(package: Path, effort: Effort) -> Section:
    """Measure calls without a pause, alone and beside a 1280x960 stream to the same process."""
    seconds = effort.seconds(_SECONDS)
    with Lab(package) as lab:
        pairs = {kind: lab.pair(kind) for kind in ("ours", "ice")}
        for server, clients in pairs.values():
            begin(server, clients, "video", LARGE_IMAGE)
        subjects = {
            f"{kind}, {how}": partial(_calls, server, clients[0], seconds, beside=how == "beside")
            for kind, (server, clients) in pairs.items()
            for how in ("alone", "beside")
        }
        times = timed(subjects, effort.rounds(8))
        pairs["bare"] = lab.pair("bare")
        with _simulator():
            busy = timed(
                {
                    f"{kind}, beside a simulator": partial(
                        clients[0].do, "call", operation="step", seconds=seconds
                    )
                    for kind, (_, clients) in pairs.items()
                },
                effort.rounds(8),
            )
    times |= busy
    ours, ice = (busy[f"{kind}, beside a simulator"] for kind in ("ours", "ice"))
    times_ice = ratio(ours.medians, ice.medians)
    p99 = percentile(times["ours, beside"].all, 0.99)
    names = {"ours": "generated proxy", "ice": "Ice twoway", "bare": "bare Zenoh querier and queryable"}
    return Section(
        "beside",
        figures=[
            Figure(
                f"a call beside a {RATE:.0f} frames/s 1280x960 stream: p99",
                f"under {P99 * 1e3} ms",
                f"{milliseconds(p99)} ms",
                p99 < P99,
            ),
            Figure(
                "a call while a simulated robot runs on the same processors, against Ice's",
                f"at most {TIMES_ICE:g} times its median",
                f"{times_ice} times; p99 {milliseconds(ours.p99)} ms against {milliseconds(ice.p99)} ms",
                times_ice.median <= TIMES_ICE,
            ),
        ],
        tables=[
            Table(
                "4 doubles there and back",
                ["", "p50 us", "p99 us", "longest ms"],
                [
                    [
                        f"{names[name.partition(',')[0]]}{name[name.index(',') :]}",
                        str(spread([median * 1e6 for median in each.medians])),
                        microseconds(percentile(each.all, 0.99)),
                        milliseconds(max(each.all)),
                    ]
                    for name, each in times.items()
                ],
            )
        ],
        plot={name: {"p50": each.median.median, "p99": each.p99} for name, each in times.items()},
    )


@contextmanager
def _simulator() -> Iterator[None]:
    """Run a simulated robot without clients."""
    with ComponentProcess(module("naoserver_sim", "--listen", free_endpoint())) as simulator:
        simulator.wait_for("ready")
        yield


def _calls(server: Worker, client: Worker, seconds: float, *, beside: bool) -> list[float]:
    if beside:
        server.do("start_sending", stream="video", rate=RATE, size=LARGE_IMAGE)
    client.do("forget")
    times: list[float] = client.do("call", operation="step", seconds=seconds)
    if beside:
        server.do("stop_sending")
        if client.do("heard") < seconds * RATE / 2:
            raise RuntimeError(f"{client.name}: no samples arrived")
    return times
