"""A long run of mixed load, in which clients and a server are repeatedly killed and restarted."""

from __future__ import annotations

import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np
import psutil

from tests.support.processes import free_endpoint

from .figures import Effort, Figure, Section, Table
from .processes import Lab, Worker
from .soak_client import RESTARTED, STEADY

KILL_CLIENT: Final = 5.0  # s
KILL_SERVER: Final = 30.0
CALL_LIMIT: Final = 2.5
"""s within which every call ends: its limit, with a margin for a busy machine."""
GROWTH: Final = 0.05
"""The largest apparent growth of memory during the measured part of the run, as a share."""

_SAMPLE: Final = 1.0
_SETTLING: Final = 0.25  # share of the run in which caches and pools fill


@dataclass
class Usage:
    """Samples of the resources of a process."""

    pid: int
    times: list[float] = field(default_factory=list)
    memory: list[float] = field(default_factory=list)
    """Resident private memory in MB."""
    shared: list[float] = field(default_factory=list)
    """Resident shared memory in MB."""
    threads: list[int] = field(default_factory=list)
    handles: list[int] = field(default_factory=list)

    def sample(self, now: float) -> None:
        """Sample the process."""
        process = psutil.Process(self.pid)
        with process.oneshot():
            facts = process.memory_info()
            self.times.append(round(now, 1))
            self.memory.append(round((facts.rss - facts.shared) / 1e6, 2))
            self.shared.append(_shared_memory(self.pid))
            self.threads.append(process.num_threads())
            self.handles.append(process.num_fds())

    def trend(self, values: list[float] | list[int]) -> tuple[float, float, float]:
        """Return the first and the last level after the start-up phase, and the slope per minute."""
        times = np.array(self.times)
        settled = times >= _SETTLING * times[-1]
        chosen, when = np.array(values, float)[settled], times[settled]
        slope, start = (float(each) for each in np.polyfit(when, chosen, 1))
        return start + slope * float(when[0]), start + slope * float(when[-1]), slope * 60.0


def measure(package: Path, effort: Effort) -> Section:
    """Run the load; watch a server and a client that are not killed, and count how calls end."""
    seconds = effort.soak_minutes * 60.0
    with Lab(package) as lab:
        endpoints = [free_endpoint(), free_endpoint()]
        steady = lab.worker("soak-server", "ours", endpoints[:1], STEADY).wait_until_ready()
        restarted = _server(lab, endpoints[1]).wait_until_ready()
        resident = lab.worker("soak-client", "ours", endpoints).wait_until_ready()
        visitor = lab.worker("soak-client", "ours", endpoints).wait_until_ready()
        usages = {"server": Usage(steady.pid), "client": Usage(resident.pid)}
        kills: Counter[str] = Counter()
        begin = time.monotonic()
        next_client, next_server, next_sample = KILL_CLIENT, KILL_SERVER, 0.0
        while (now := time.monotonic() - begin) < seconds:
            if now >= next_sample:
                next_sample = now + _SAMPLE
                for usage in usages.values():
                    usage.sample(now)
            if now >= next_client:
                next_client += KILL_CLIENT
                visitor.kill()
                visitor = lab.worker("soak-client", "ours", endpoints)
                kills["clients"] += 1
            if now >= next_server:
                next_server += KILL_SERVER
                restarted.kill()
                restarted = _server(lab, endpoints[1])
                kills["servers"] += 1
            time.sleep(0.05)
        counts: dict[str, Any] = resident.do("stop")
    return _section(effort, usages, kills, counts)


def _server(lab: Lab, endpoint: str) -> Worker:
    return lab.worker("soak-server", "ours", [endpoint], RESTARTED)


def _section(
    effort: Effort, usages: dict[str, Usage], kills: Counter[str], counts: dict[str, Any]
) -> Section:
    flat, rows, worst = True, [], []
    for name, usage in usages.items():
        for what, values, unit in (
            ("private memory", usage.memory, "MB"),
            ("shared memory", usage.shared, "MB"),
            ("threads", usage.threads, ""),
            ("file handles", usage.handles, ""),
        ):
            first, last, slope = usage.trend(values)
            # Shared memory is a pool that fills up; threads and handles depend on the killed clients.
            most = max(GROWTH * first, 1.0 if unit else 1.5)
            good = last - first <= most
            flat &= good
            rows.append(
                [
                    f"{name}: {what}",
                    f"{first:.1f} {unit}".strip(),
                    f"{last:.1f} {unit}".strip(),
                    f"{slope * 1000:+.1f} kB" if unit else f"{slope:+.3f}",
                    "flat" if good else "grows",
                ]
            )
            if what == "private memory":
                worst.append(f"{name} {slope * 1000:+.1f} kB a minute")
    lost = counts["begun"] - counts["ended"]
    ends = {
        name: count
        for name, count in sorted(counts.items())
        if name not in {"begun", "ended", "longest", "samples", "torn"}
    }
    name = f"soak of {effort.soak_minutes:g} minutes"
    killed = f"{kills['clients']} clients and {kills['servers']} servers killed"
    return Section(
        "soak",
        figures=[
            Figure(f"{name}: memory, threads, handles", "flat", "; ".join([*worst, killed]), flat),
            Figure(
                f"{name}: calls",
                "every one ended",
                f"{counts['ended']} of {counts['begun']}, the longest after {counts['longest']:.2f} s",
                lost == 0 and counts["longest"] <= CALL_LIMIT,
            ),
            Figure(
                f"{name}: torn values",
                "none",
                f"{counts.get('torn', 0)} of {counts['samples'] + counts['ended']}",
                not counts.get("torn", 0),
            ),
        ],
        tables=[
            Table(
                "once settled",
                ["", "at the beginning", "at the end", "a minute", ""],
                rows,
            ),
            Table("how calls ended", ["", "calls"], [[end, str(count)] for end, count in ends.items()]),
        ],
        plot={
            name: {
                "minutes": [round(time / 60, 3) for time in usage.times],
                "memory": usage.memory,
                "shared": usage.shared,
            }
            for name, usage in usages.items()
        },
    )


def _shared_memory(pid: int) -> float:
    for line in Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith("RssShmem:"):
            return int(line.split()[1]) / 1e3
    return 0.0
