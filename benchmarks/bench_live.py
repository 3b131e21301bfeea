"""Measure the monitor: the cost of following a component, the delay of its changes, and its reload.

A component of 20 automata, each of which changes its state twice a second, runs with the fake robot.

`server`: this process follows it like the editor's server, and encodes the JSON for one page. The cost is
that of this process, the delay the time from the code of the new state to the JSON of its snapshot.

`page`: Chromium follows it on the canvas with software rendering. `seen` is the time from the code of the new
state in the component until the frame that shows it; `server` is the processor time of the editor's server
as a share of a core, and `rate` the number of snapshots per second in the page.

`reload`: a component of 50 states in several active automata runs. Repeatedly one of its automata is edited
and the component is reloaded through its monitor, over Zenoh on loopback. `call` is the duration of the whole
call for its caller, `held` the time in which no cycle could start. A cycle is missed if a slot of an
automaton's schedule has none.

    python benchmarks/bench_live.py [--seconds 10] [--reloads 30] [server] [page] [reload]
"""

from __future__ import annotations

import argparse
import asyncio
import statistics
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import msgspec
import psutil

from benchmarks.common import parts, percentile, used
from codegen.diagnostics import Diagnostics
from codegen.hfsm import write_document
from codegen.hfsm.document import Automaton, Document, Library, State, Text, Transition
from hfsm_runtime._runtime import Runtime
from hfsm_runtime.debugger.monitor import Monitor
from hfsm_runtime.observer import Observer
from hfsm_runtime.tree import Actor
from interfaces.hfsm import HfsmMonitorPrx
from tests.support.browser import chromium
from tests.support.documents import compile_to, document, load, state, sub, transition
from tests.support.processes import ComponentProcess, free_endpoint, module
from visualhfsm._document.generate import generate_component
from visualhfsm._monitor.followers import Followers
from visualhfsm._monitor.messages import Snapshot
from visualhfsm._monitor.realm.run_log import LiveSnapshot
from zenoh_ice import Settings, WallClock, initialize

AUTOMATA: Final = 20
WARM_UP: Final = 3.0
SHARE: Final = 0.15
"""The largest share of a core for following, without 3D and cameras."""
SEEN: Final = 150.0
"""The largest median delay in ms until a change is visible in the page."""
_FOLLOW: Final = """async (seconds) => {
  const module = (name) => import([...document.querySelectorAll('link[rel=modulepreload]')]
    .find((link) => link.href.endsWith('/data/commands.js')).href.replace('data/commands.js', `${name}.js`));
  const {monitor} = await module('run/monitor');
  const {page} = await module('data/page');
  page.open(2);
  const painted = () => new Promise((done) => requestAnimationFrame(() => setTimeout(done)));
  const late = [];
  let snapshots = 0;
  let pictures = 0;
  let state = 0;
  monitor.addEventListener('snapshot', () => (snapshots += 1));
  const observer = new MutationObserver(async () => {
    const now = monitor.newest.component.automata.find((each) => each.id === 2);
    if (now.state === state || !document.querySelector(`hfsm-canvas [data-key=s${now.state}].active`)) return;
    state = now.state;
    const changed = Number(now.variables.changed);
    await painted();
    late.push(Date.now() - 1000 * changed);
  });
  const circles = document.querySelector('hfsm-canvas .circles');
  observer.observe(circles, {subtree: true, attributes: true, attributeFilter: ['class']});
  const count = () => { pictures += 1; requestAnimationFrame(count); };
  requestAnimationFrame(count);
  await new Promise((done) => setTimeout(done, seconds * 1000));
  observer.disconnect();
  return {late: late.slice(1), rate: snapshots / seconds, pictures: pictures / seconds};
}"""
LONGEST = 0.1
"""The longest time of a reload in s."""


@contextmanager
def running(document: Document) -> Iterator[tuple[str, str]]:
    """Run a component beside the fake robot; yield the robot's endpoint, and the component's folder."""
    endpoint = free_endpoint()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "crowd.xml")
        path.write_text(write_document(document), encoding="utf-8")
        component = generate_component(path, None, Diagnostics())
        assert component is not None
        command = [sys.executable, str(component), "--connect", endpoint, "--clock", "wall"]
        with ComponentProcess(module("naoserver.fake", "--listen", endpoint)) as robot:
            robot.wait_for("ready")
            with ComponentProcess(command, {"PYTHONPATH": str(Path(__file__).parents[1])}):
                yield endpoint, folder


def crowd(now: str = "time.monotonic()") -> Document:
    """Return a document of 20 parallel automata below a root, which note when they change."""
    stamp = Text(f"changed = {now}")
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


async def follow(endpoint: str, seconds: float, *, poses: bool) -> tuple[Measurement, float]:
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
        before, began = time.process_time(), time.perf_counter()
        await asyncio.sleep(seconds)
        return measurement, (time.process_time() - before) / (time.perf_counter() - began)
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


class Slots(Observer):
    """Counts the cycles of each automaton, and the slots without a cycle."""

    def __init__(self) -> None:
        self.cycles: dict[int, int] = defaultdict(int)
        self.missed: dict[int, int] = defaultdict(int)
        self._last: dict[int, int] = {}

    def cycle_began(self, run: Actor, at: int) -> None:
        """Compare with the slot of the previous cycle."""
        number = run.automaton.id
        last = self._last.get(number)
        if last is not None:
            self.missed[number] += round((at - last) / run.automaton.interval) - 1
        self._last[number] = at
        self.cycles[number] += 1


def text(states: int, automata: int, period: float, version: int) -> str:
    """Return a document whose root has one state that owns all other automata; the first one is edited."""
    below = automata - 1
    each = [states // below + (number < states % below) for number in range(below)]
    root_state = state(1, "all", initial=True, child=2).replace(
        "<code>", "".join(f"<child>{number}</child>" for number in range(3, automata + 1)) + "<code>"
    )
    parts = [sub(1, 0, root_state, period=f"{period * 1000:g}")]
    for number, count in enumerate(each, 2):
        edited = f"total += {version}" if number == 2 else "total += 1"
        code = f"count += 1\n{edited}\nhistory.append(count)\ndel history[:-10]"
        found = [
            state(which, f"state {which}", code, initial=which == 1)
            + transition(which, which, which % count + 1, "count % 7 == 0 and total >= 0")
            for which in range(1, count + 1)
        ]
        variables = "count = 0\ntotal = 0\nhistory = []\nlimits = [0.1, 0.2, 0.3]\nname = 'x'"
        parts.append(sub(number, 1, *found, variables=variables, period=f"{period * 1000:g}"))
    return document(*parts)


def reload(states: int, automata: int, period: float, reloads: int, directory: Path) -> bool:
    """Reload a component repeatedly and print the figures; return whether it was fast enough."""
    versions: list[str] = []
    compiles: list[float] = []
    for version in range(reloads, 0, -1):  # in advance, as another process compiles them
        began = time.perf_counter()
        file = compile_to(directory, text(states, automata, period, version), "many")
        compiles.append(time.perf_counter() - began)
        versions.insert(0, file.read_text(encoding="utf-8"))
    lines = len(file.read_text(encoding="utf-8").splitlines())
    endpoint = free_endpoint()
    slots = Slots()
    with (
        initialize(listen=[endpoint], connect=[], clock="wall") as server,
        initialize(connect=[endpoint], clock="wall") as client,
    ):
        runtime = Runtime(load(file), WallClock())
        runtime.tree.observers.append(slots)
        with Monitor(runtime, server):
            runtime.start()
            proxy = HfsmMonitorPrx.checkedCast(client.stringToProxy("Hfsm.many"))
            time.sleep(1.0)
            before = sum(slots.missed.values())
            calls, holds, not_kept = [], [], 0
            for source in versions:
                file.write_text(source, encoding="utf-8")
                began = time.perf_counter()
                report = proxy.reload()
                calls.append(time.perf_counter() - began)
                holds.append(report.held)
                not_kept += len(report.notKept)
                time.sleep(3.3 * period)
            missed = sum(slots.missed.values()) - before
            cycles = sum(slots.cycles.values())
            runtime.stop()
    print(f"{states} states in {automata} automata of {1 / period:g} Hz, {lines} lines; {reloads} reloads")
    for label, values in (("call", calls), ("held", holds), ("compile", compiles)):
        middle, worst = 1000 * statistics.median(values), 1000 * max(values)
        print(f"  {label:8} median {middle:7.2f} ms   worst {worst:7.2f} ms")
    print(f"  {cycles} cycles, {missed} missed during reloads, {before} before; {not_kept} values lost")
    return max(calls) < LONGEST and missed == 0


def served(given: argparse.Namespace) -> bool:
    """Print what following costs, without and with all panels; return True."""
    with running(crowd()) as (endpoint, _):
        for poses in (False, True):
            measurement, share = asyncio.run(follow(endpoint, given.seconds, poses=poses))
            delays = [1000 * delay for delay in measurement.delays]
            panels, most = (", 3D and two cameras", "") if poses else ("", f" (at most {SHARE:.0%})")
            print(
                f"{AUTOMATA} automata{panels}: {share:.1%} of a core{most}, "
                f"{len(measurement.sizes) / given.seconds:.0f} snapshots/s of "
                f"{statistics.median(measurement.sizes) / 1000:.1f} kB; change to JSON: median "
                f"{statistics.median(delays):.1f} ms (at most {SEEN:g} ms), "
                f"95 % below {percentile(delays, 0.95):.1f} ms ({len(delays)} changes)"
            )
    return True


def shown(given: argparse.Namespace) -> bool:
    """Print when changes are seen; return whether that is within the limits."""
    with running(crowd("time.time()")) as (endpoint, folder):  # the page has only the wall clock
        edit = ("edit", f"{folder}/crowd.xml", "--root", folder, "--no-browser", "--connect", endpoint)
        with (
            ComponentProcess(module("visualhfsm", *edit), {"XDG_STATE_HOME": folder}) as editor,
            chromium() as browser,
        ):
            page = browser.new_page(viewport={"width": 1280, "height": 800})
            page.goto(editor.wait_for(r"The editor is at (\S+)")[1])
            page.get_by_role("button", name="1 running").click()
            page.get_by_role("menuitem", name="crowd").click()
            page.locator(".live-status.running").wait_for()
            page.wait_for_timeout(1000 * WARM_UP)
            process = psutil.Process(editor.process.pid)
            before = used(process)
            found: dict[str, Any] = page.evaluate(_FOLLOW, given.seconds)
            share = (used(process) - before) / given.seconds
            page.close()
    late = found["late"]
    seen = statistics.median(late)
    print(
        f"{AUTOMATA} automata: change seen after {seen:.0f} ms in the median (at most {SEEN:g} ms), "
        f"95 % below {percentile(late, 0.95):.0f} ms, of {len(late)}; {found['rate']:.0f} snapshots/s, "
        f"{found['pictures']:.0f} pictures/s; server {share:.1%} of a core (at most {SHARE:.0%})"
    )
    return bool(seen <= SEEN and share <= SHARE)


def reloaded(given: argparse.Namespace) -> bool:
    """Print how long reloads take; return whether that is within the limits."""
    with tempfile.TemporaryDirectory() as folder:
        fine = reload(given.states, given.automata, given.period, given.reloads, Path(folder))
    print("within the limits" if fine else f"NOT within the limits: {LONGEST:g} s, no missed cycle")
    return fine


def main() -> None:
    """Print the figures; exit with 1 if a limit is exceeded."""
    measured = {"server": served, "page": shown, "reload": reloaded}
    fine = parts(__doc__, measured, seconds=10.0, states=50, automata=6, period=0.02, reloads=30)
    sys.exit(not all(fine))


if __name__ == "__main__":
    main()
