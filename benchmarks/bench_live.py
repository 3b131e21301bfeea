"""Measure the cost of following a component for the editor's server, and the delay of state changes.

A component of 20 automata, each of which changes its state twice a second, runs in a separate process with
the fake robot. Required are at most 15 % of a core for the status, and at most 150 ms until a change is
visible, of which this is a part. The cost is that of this process, which follows the component like the
server and encodes the JSON for one page. The delay is the time from the code of the new state to the JSON of
its snapshot.
"""

from __future__ import annotations

import asyncio
import statistics
import sys
import tempfile
import time
from pathlib import Path
from typing import Final

import msgspec
import psutil

from codegen.diagnostics import Diagnostics
from codegen.hfsm import write_document
from codegen.hfsm.document import Automaton, Document, Library, State, Text, Transition
from tests.support.processes import ComponentProcess, free_endpoint, module
from visualhfsm._document.generate import generate_component
from visualhfsm._monitor.followers import Followers
from visualhfsm._monitor.messages import Snapshot
from visualhfsm._monitor.realm.run_log import LiveSnapshot
from zenoh_ice import Settings

AUTOMATA: Final = 20
SECONDS: Final = 10.0
WARM_UP: Final = 3.0
SHARE: Final = 0.15
"""The largest share of a core for following, without 3D and cameras."""
SEEN: Final = 150.0
"""The largest median delay in ms until a change is visible in the page."""


def crowd() -> Document:
    """Return a document of 20 parallel automata below a root."""
    stamp = Text("changed = time.monotonic()")
    children = tuple(
        Automaton(
            id=number,
            father=1,
            states=(
                State(id=1, name="tick", initial=True, entry=stamp, code=Text("count += 1")),
                State(id=2, name="tock", entry=stamp, code=Text("count += 1")),
            ),
            transitions=(
                Transition(id=1, name="to tock", origin=1, destination=2, type="time", trigger=Text("500")),
                Transition(id=2, name="to tick", origin=2, destination=1, type="time", trigger=Text("500")),
            ),
            variables=Text("changed = 0.0\ncount = 0\nname = 'nao'\nlevel = 0.5"),
        )
        for number in range(2, AUTOMATA + 1)
    )
    root = Automaton(
        id=1,
        states=(State(id=1, name="all", initial=True, children=tuple(child.id for child in children)),),
    )
    return Document(automata=(root, *children), libraries=(Library(name=Text("time")),))


class Measurement:
    """The JSON that one page gets, and its delays."""

    def __init__(self) -> None:
        self.delays: list[float] = []
        self.sizes: list[int] = []
        self._states: dict[int, int] = {}

    def publish(self, push: object) -> None:
        """Record what the server would send."""
        encoded = msgspec.json.encode(push)
        now = time.monotonic()
        if not isinstance(push, Snapshot) or not isinstance(push.value, LiveSnapshot):
            return
        self.sizes.append(len(encoded))
        for automaton in push.value.component.automata:
            before = self._states.get(automaton.id)
            self._states[automaton.id] = automaton.state
            if before is not None and before != automaton.state and "changed" in automaton.variables:
                self.delays.append(now - float(automaton.variables["changed"]))


async def follow(endpoint: str, *, poses: bool) -> tuple[Measurement, float]:
    """Follow the component; return the measurement and the share of a core that it took."""
    measurement = Measurement()
    service = Followers(measurement.publish, Settings(connect=(endpoint,), clock="wall"))
    task = asyncio.create_task(watch_poses(service)) if poses else None
    try:
        async with asyncio.timeout(20):
            while True:
                try:
                    await service.follow("crowd")
                    break
                except Exception:  # noqa: BLE001 - not running yet
                    await asyncio.sleep(0.1)
        await asyncio.sleep(WARM_UP)
        measurement.delays.clear()
        measurement.sizes.clear()
        before, began = psutil.Process().cpu_times(), time.perf_counter()
        await asyncio.sleep(SECONDS)
        after, ended = psutil.Process().cpu_times(), time.perf_counter()
        return measurement, (after.user + after.system - before.user - before.system) / (ended - began)
    finally:
        if task is not None:
            task.cancel()
            await asyncio.wait({task})
        await service.close()


async def watch_poses(service: Followers) -> None:
    """Watch the robot in 3D and both cameras, like a page with all its panels."""

    async def drain(name: str) -> None:
        async for _ in service.camera(name) if name else service.poses("en"):
            pass

    await asyncio.sleep(1)
    await asyncio.gather(*(drain(name) for name in ("", "Camera", "CameraBottom")))


def main() -> None:
    endpoint = free_endpoint()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "crowd.xml")
        path.write_text(write_document(crowd()), encoding="utf-8")
        component = generate_component(path, None, Diagnostics())
        assert component is not None
        command = [sys.executable, str(component), "--connect", endpoint, "--clock", "wall"]
        environment = {"PYTHONPATH": str(Path(__file__).parents[1])}
        with (
            ComponentProcess(module("naoserver.fake", "--listen", endpoint)) as server,
            ComponentProcess(command, environment),
        ):
            server.wait_for("ready")
            for poses in (False, True):
                measurement, share = asyncio.run(follow(endpoint, poses=poses))
                delays = sorted(1000 * delay for delay in measurement.delays)
                late = delays[int(0.95 * len(delays))]
                panels, most = (", 3D and two cameras", "") if poses else ("", f" (at most {SHARE:.0%})")
                print(
                    f"{AUTOMATA} automata{panels}: {share:.1%} of a core{most}, "
                    f"{len(measurement.sizes) / SECONDS:.0f} snapshots/s of "
                    f"{statistics.median(measurement.sizes) / 1000:.1f} kB; change to JSON: median "
                    f"{statistics.median(delays):.1f} ms (at most {SEEN:g} ms), 95 % below {late:.1f} ms "
                    f"({len(delays)} changes)"
                )


if __name__ == "__main__":
    main()
