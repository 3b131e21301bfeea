"""Measure the editor: a key, Run and STOP, and the starts of all that people start.

`keys`: processor and wall time of the editor's server and its children from a key in the code field that
makes a mistake until the problem of its red line is sent, in `score.xml` and in a document of 40 automata
made of it; wall time counts from the end of the pause of typing.

`run`: from the key to a simulated robot in a separate process. `run` is the time from F5 until the canvas
shows the first live state. `latched` is the time from STOP until the robot's emergency stop is latched, as
another client sees it; `shown` that until the page no longer says that the component runs, `ended` that until
it says how it ended. Each is measured with a component that is silent, and with one that prints without end;
`--burners` adds processes that take all processor time that they get.

`demo`, `help`, `server`, `component`: wall seconds, with the processor seconds of the process beside it where
others load the machine. `demo` is `make demo` in a prepared environment until the robot's head turns; `help`
is a command with `--help`; `server` is `naoserver-sim` until it is ready, and its memory, without a client;
`component` is a dance until a client that waits for it has its first snapshot.

    python benchmarks/bench_editor.py [--runs 5] [--keys 8] [--burners 0] [PART...]
"""

from __future__ import annotations

import argparse
import os
import random
import re
import resource
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Final

from playwright.sync_api import Browser, Page, sync_playwright

from benchmarks.common import parts
from codegen.diagnostics import Diagnostics
from codegen.hfsm import read_document, write_document
from codegen.hfsm.document import State, Text, Transition
from interfaces.hfsm import HfsmMonitorPrx
from interfaces.nao import PoseHeadPrx, SafetyPrx, SafetyState
from tests.support.browser import FLAGS, NO_CHROMIUM, chromium_path
from tests.support.editor import Window, editor, no_parts
from tests.support.places import ROOT
from tests.support.processes import ComponentProcess, free_endpoint, module
from visualhfsm._editor.limits import Limits
from zenoh_ice import Sample, initialize

ENDING: Final = 10.0  # s within which the server must end
MODULE: Final = """
const module = (name) => import([...document.querySelectorAll('link[rel=modulepreload]')]
    .find((link) => link.href.endsWith('/data/commands.js')).href.replace('data/commands.js', `${name}.js`));
const painted = () => new Promise((done) => requestAnimationFrame(() => setTimeout(done)));
"""
QUIET: Final = 0.03  # s, the pause of typing
AUTOMATA: Final = 40
MISTAKES: Final = {"syntax": "self.foo({turn}", "name": "unknown_{turn} + 1"}
REALM: Final = "bench"
EVENT: Final = 60.0  # s for each event
CODES: Final = {
    "silent": "count += 1",
    "printing": "while True:\n    count += 1\n    print('flood', count, 'x' * 200)",
}
DOCUMENT: Final = """<VisualHFSM><SubAutomata id="1" idFather="0">
<state initial="true" id="1"><posx>100</posx><posy>150</posy><name>work</name><code>{code}</code></state>
<variables>count = 0</variables></SubAutomata></VisualHFSM>"""
_WATCH: Final = """
    window.first = {};
    const now = () => performance.timeOrigin + performance.now();
    const note = () => {
        const said = document.querySelector(".live-status")?.innerText ?? "";
        if (document.querySelector("hfsm-canvas .state.active")) first.run ??= now();
        if (!said.startsWith("Running")) first.shown ??= now();
        if (said.startsWith("Ended")) first.ended ??= now();
    };
    new MutationObserver(note).observe(document,
        {subtree: true, childList: true, characterData: true, attributes: true});
    window.addEventListener("keydown", (event) => {
        if (event.code === "F5") window.first = {f5: now()};
        if (event.code === "Space") window.first = {run: first.run, f5: first.f5, stop: now()};
    }, true);
"""
"""The page's own times, in ms of the epoch: listens before the page does."""
TURNING: Final = 0.05
"""Speed in rad/s above which the head counts as turning."""
START: Final = 300.0  # s for each start, on a machine that is loaded
SETTLED: Final = 2.0  # s after which the memory of a server is read
COMMANDS: Final = ("codegen", "nao", "visualhfsm", "naoserver-sim")
DANCE: Final = str(ROOT / "behaviors/dance.py")
Row = tuple[str, Sequence[tuple[float, ...]], str]
"""What was measured, its figures of each run, and how they are shown."""
_SERVER: Final = "{:.2f} s, processor {:.2f} s, RSS {:.0f} MB, PSS {:.0f} MB"


@contextmanager
def optimized_chromium() -> Iterator[Browser]:
    """Start Chromium as people have it: with optimized code."""
    with sync_playwright() as playwright:
        flags = [flag for flag in FLAGS if not flag.startswith("--js-flags")]
        browser = playwright.chromium.launch(executable_path=chromium_path(), args=flags)
        try:
            yield browser
        finally:
            browser.close()


@contextmanager
def edited(text: str) -> Iterator[tuple[Window, int]]:
    """Open a document in an editor, and yield its window, and the number of the tab."""
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder) / "project"
        root.mkdir()
        (root / "a.xml").write_text(text)
        limits = Limits(quiet_seconds=QUIET, file_check_seconds=3600.0, operation_seconds=60.0)
        with (
            editor(root, root / "a.xml", limits=limits, make_parts=no_parts, port=0) as running,
            running.window() as window,
        ):
            yield window, 1


@contextmanager
def burners(count: int) -> Iterator[None]:
    """Keep the processors busy within the block."""
    with ExitStack() as ends:
        for _ in range(count):
            process = ends.enter_context(subprocess.Popen([sys.executable, "-c", "while True: pass"]))
            ends.callback(process.kill)
        yield


def grid(states: int, transitions: int) -> str:
    """Return a document of one automaton with rows of states, and transitions mostly between neighbors."""
    dice = random.Random(1)
    columns = max(1, round((states * 1.3) ** 0.5))
    places = [(240 * (index % columns), 200 * (index // columns)) for index in range(states)]
    parts = [
        f'<state id="{index + 1}" initial="{str(index == 0).lower()}"><posx>{x}</posx><posy>{y}</posy>'
        f"<name>state {index + 1}</name><code>pass</code></state>"
        for index, (x, y) in enumerate(places)
    ]
    for number in range(1, transitions + 1):
        origin = dice.randrange(states)
        end = (origin + dice.choice([1, 2, columns, columns + 1, -1])) % states
        (x, y), (to_x, to_y) = places[origin], places[end]
        handle = (x + to_x) / 2 + dice.uniform(-30, 30), (y + to_y) / 2 + dice.uniform(-30, 30)
        parts.append(
            f'<transition id="{number}"><posx>{handle[0]:.0f}</posx><posy>{handle[1]:.0f}</posy>'
            f"<origin>{origin + 1}</origin><destiny>{end + 1}</destiny>"
            f'<name>go {number}</name><trans type="time">{1000 + number}</trans></transition>'
        )
    return f'<VisualHFSM><SubAutomata id="1" idFather="0">{"".join(parts)}</SubAutomata></VisualHFSM>'


@contextmanager
def server(root: Path, *files: str, checkout: Path = ROOT) -> Iterator[str]:
    """Start the editor of a checkout as a separate process and yield its address."""
    command = [sys.executable, "-m", "visualhfsm", "edit", *files, "--no-browser"]
    environment = {**os.environ, "XDG_STATE_HOME": str(root / "state"), "PYTHONPATH": str(checkout)}
    process = subprocess.Popen(command, cwd=root, stdout=subprocess.PIPE, text=True, env=environment)
    assert process.stdout is not None
    try:
        found = next((match[0] for line in process.stdout if (match := re.search(r"http://\S+", line))), None)
        if found is None:
            sys.exit("the editor did not start")
        yield found
    finally:
        process.terminate()
        process.wait(ENDING)
        process.stdout.close()


def forty(path: Path) -> str:
    """Return a document of 40 automata: one above copies of that of a file."""
    document = read_document(path, Diagnostics())
    assert document is not None
    (only,) = document.automata
    numbers = range(1, AUTOMATA)
    at = {number: (300.0 * (number % 7), 200.0 * (number // 7)) for number in numbers}
    states = tuple(
        State(
            id=each,
            name=f"part {each}",
            initial=each == 1,
            children=(each + 1,),
            x=at[each][0],
            y=at[each][1],
        )
        for each in numbers
    )
    transitions = tuple(
        Transition(id=each, origin=each, destination=each % len(numbers) + 1, type="finished", y=9.0 * each)
        for each in numbers
    )
    top = replace(only, states=states, transitions=transitions, annotations=(), variables=Text())
    below = (replace(only, id=each + 1, father=1, functions=Text()) for each in numbers)
    return write_document(replace(document, automata=(replace(top, id=1), *below)))


def processor_time() -> float:
    """Return the processor time of this process and its children in s."""
    used = 0.0
    found = subprocess.run(
        ["ps", "-o", "pid=", "--ppid", str(os.getpid())], capture_output=True, text=True, check=False
    )
    for child in found.stdout.split():
        try:
            fields = Path(f"/proc/{child}/stat").read_text().rpartition(")")[2].split()
        except OSError:
            continue
        used += (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return used + time.process_time()


def red_line(window: Window, tab: int, place: dict[str, Any], code: str) -> None:
    """Type code, and wait for its problem."""
    command = {"command": "setText", "place": place, "text": code}
    number = window.send("do", tab=tab, command=command)
    window.wait_for(lambda message: message.get("re") == number)
    window.wait_for(lambda message: message.get("push") == "problems" and _has_problem(message, place))


def _has_problem(message: dict[str, Any], place: dict[str, Any]) -> bool:
    return any(
        each.get("place", {}).get("part") == place["part"]
        and each["place"].get("automaton") == place["automaton"]
        for each in message["items"]
    )


def settle(window: Window, tab: int, place: dict[str, Any], code: str) -> None:
    """Type correct code, and wait until the checks have nothing more to do."""
    command = {"command": "setText", "place": place, "text": code}
    number = window.send("do", tab=tab, command=command)
    window.wait_for(lambda message: message.get("re") == number)
    window.wait_for(lambda message: message.get("push") == "problems" and not _has_problem(message, place))


def place_in(automaton: int) -> dict[str, Any]:
    """Return the place of code of an automaton."""
    return {"kind": "state", "automaton": automaton, "id": 1, "part": "code"}


def time_key(text: str, automaton: int, mistake: str, keys: int) -> tuple[float, float]:
    """Return processor and wall time of a key until its red line in s, without the pause of typing."""
    place = place_in(automaton)
    used, waited = [], []
    with edited(text) as (window, tab):
        window.wait_for(lambda message: message.get("push") == "problems")
        for turn in range(keys):
            settle(window, tab, place, f"ball = {turn}")
            window.pushes.clear()
            time.sleep(0.3)
            began, at = processor_time(), time.monotonic()
            red_line(window, tab, place, mistake.format(turn=turn))
            waited.append(time.monotonic() - at - QUIET)
            used.append(processor_time() - began)
    return statistics.median(used), statistics.median(waited)


def once(page: Page, safety: SafetyPrx, latched: list[float], *, seconds: float) -> dict[str, float]:
    """Run the component, press STOP some seconds later, and reset the robot; return times in ms."""
    page.keyboard.press("F5")
    page.wait_for_function("() => window.first.run", timeout=EVENT * 1000)
    page.wait_for_timeout(seconds * 1000)
    latched.clear()
    page.keyboard.press("Control+Shift+Space")
    page.wait_for_function("() => window.first.ended", timeout=EVENT * 1000)
    end = time.monotonic() + EVENT
    while not latched:
        if time.monotonic() > end:
            sys.exit("the robot did not stop")
        time.sleep(0.01)
    first = page.evaluate("() => window.first")
    safety.resetEmergencyStop()
    page.get_by_role("alert").filter(has_text="The robot is stopped").wait_for(
        state="detached", timeout=EVENT * 1000
    )
    return {
        "run": first["run"] - first["f5"],
        "latched": latched[0] * 1000 - first["stop"],
        "shown": first["shown"] - first["stop"],
        "ended": first["ended"] - first["stop"],
    }


def run_and_stop(code: str, runs: int, load: int) -> list[dict[str, float]]:
    """Measure one component several times, in one page."""
    with ExitStack() as stack:
        root = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        (root / "work.xml").write_text(DOCUMENT.format(code=code))
        endpoint = free_endpoint()
        robot = ComponentProcess(module("naoserver_sim", "--listen", endpoint, "--realm", REALM))
        stack.enter_context(robot).wait_for("^ready")
        communicator = stack.enter_context(initialize(realm=REALM, connect=[endpoint], clock="wall"))
        safety = SafetyPrx.checkedCast(communicator.stringToProxy("Safety"))
        latched: list[float] = []

        def note(sample: Sample[SafetyState]) -> None:
            if sample.value.stopped:
                latched.append(time.time())

        stack.enter_context(safety.getSafetyState.subscribe(note))
        os.environ |= {"VISUALHFSM_REALM": REALM, "VISUALHFSM_CONNECT": endpoint}
        address = stack.enter_context(server(root, "work.xml"))
        page = stack.enter_context(optimized_chromium()).new_page(viewport={"width": 1280, "height": 800})
        page.add_init_script(_WATCH)
        page.goto(address)
        page.locator("hfsm-canvas .state").first.wait_for()
        once(page, safety, latched, seconds=2.0)
        with burners(load):
            return [once(page, safety, latched, seconds=2.0) for _ in range(runs)]


def seconds_until_the_head_turns() -> float:
    """Start the demo once; return the wall seconds until the stream of the head shows that it turns."""
    start = time.monotonic()
    with ComponentProcess(["make", "--no-print-directory", "demo"]) as demo:
        endpoint = demo.wait_for(r"endpoint (tcp/[\w.:-]+)")[1]
        with initialize(connect=[endpoint], clock="wall") as communicator:
            head = PoseHeadPrx.uncheckedCast(communicator.stringToProxy("Head"))
            pose = head.getPose.wait(timeout=30)
            while max(abs(pose.value.panSpeed), abs(pose.value.tiltSpeed)) < TURNING:
                pose = head.getPose.wait(after=pose, timeout=30)
            waited = time.monotonic() - start
        os.killpg(
            demo.process.pid, signal.SIGINT
        )  # like Ctrl-C in a terminal: make itself does not forward it
        demo.wait()
    return waited


def demo(runs: int) -> Iterator[Row]:
    """Measure the demo."""
    seconds_until_the_head_turns()  # not counted: it prepares the environment if necessary
    waits = [(seconds_until_the_head_turns(),) for _ in range(runs)]
    yield "make demo until the head turns (at most 8 s)", waits, "{:.2f} s"


def help_texts(runs: int) -> Iterator[Row]:
    """Measure commands that print their options."""
    binaries = Path(sys.executable).parent
    commands = {f"{name} --help": [str(binaries / name)] for name in COMMANDS}
    commands |= {"dance.py --help": [sys.executable, DANCE]}
    for name, command in commands.items():
        yield name, [timed([*command, "--help"]) for _ in range(runs)], "{:.2f} s, processor {:.2f} s"


def timed(command: Sequence[str]) -> tuple[float, float]:
    """Run a command; return its wall and processor seconds."""
    start, before = time.monotonic(), resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, stdout=subprocess.DEVNULL, check=True, timeout=START)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    used = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
    return time.monotonic() - start, used


def processor_seconds(pid: int) -> float:
    """Return what a process has used until now."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


@contextmanager
def served(*options: str) -> Iterator[tuple[int, str]]:
    """Serve a simulated robot; yield its process and endpoint once it is ready."""
    endpoint = free_endpoint()
    with ComponentProcess(module("naoserver_sim", "--listen", endpoint, *options)) as server:
        server.wait_for("^ready", limit=START)
        yield server.process.pid, endpoint


def started(*options: str) -> tuple[float, float, float, float]:
    """Start a server; return wall and processor seconds until it is ready, and its RSS and PSS in MB."""
    start = time.monotonic()
    with served(*options) as (pid, _):
        waited, used = time.monotonic() - start, processor_seconds(pid)
        time.sleep(SETTLED)
        memory = Path(f"/proc/{pid}/smaps_rollup").read_text()
    sizes = dict(re.findall(r"^(\w+): +(\d+) kB$", memory, re.MULTILINE))
    return waited, used, int(sizes["Rss"]) / 1024, int(sizes["Pss"]) / 1024


def robot_server(runs: int) -> Iterator[Row]:
    """Measure the server of the simulated Nao."""
    yield "naoserver-sim until it is ready", [started() for _ in range(runs)], _SERVER


def component(runs: int) -> Iterator[Row]:
    """Measure a component, as the page starts one when F5 is pressed."""
    with (
        served() as (_, endpoint),
        initialize(connect=[endpoint], clock="wall") as communicator,
    ):
        monitor = HfsmMonitorPrx.uncheckedCast(communicator.stringToProxy("Hfsm.dance"))
        yield (
            "dance.py until its first snapshot",
            [until_its_snapshot(endpoint, monitor) for _ in range(runs)],
            "{:.3f} s, processor {:.3f} s",
        )


def until_its_snapshot(endpoint: str, monitor: HfsmMonitorPrx) -> tuple[float, float]:
    """Start the dance; return wall and processor seconds until the client has a snapshot of it."""
    start, began = time.monotonic(), time.time()
    with ComponentProcess([sys.executable, DANCE, "--connect", endpoint]) as dance:
        snapshot = monitor.getSnapshot.wait(timeout=START)
        while snapshot.value.startedAt < began:  # of the dance before
            snapshot = monitor.getSnapshot.wait(after=snapshot, timeout=START)
        return time.monotonic() - start, processor_seconds(dance.process.pid)


def print_keys(given: argparse.Namespace) -> bool:
    """Print the figures of a key; return True."""
    score = ROOT / "behaviors" / "score.xml"
    for title, text, automaton in (("score.xml", score.read_text(), 1), ("40 automata", forty(score), 20)):
        for name, mistake in MISTAKES.items():
            spent, waited = time_key(text, automaton, mistake, given.keys)
            what = f"key to red line, {title}, {name}"
            print(f"  {what:42} {1000 * spent:6.0f} ms of processor, {1000 * waited:5.0f} ms", flush=True)
    return True


def print_run(given: argparse.Namespace) -> bool:
    """Print the medians of Run and STOP, and the worst in brackets; return True."""
    for name, code in CODES.items():
        found = run_and_stop(code, given.runs, given.burners)
        print(f"{name}, {given.burners} burners, load {os.getloadavg()[0]:.1f}")
        for figure in found[0]:
            values = [each[figure] for each in found]
            print(f"  {figure:10} {statistics.median(values):6.0f} ms ({max(values):.0f})")
    return True


def print_start(measure: Callable[[int], Iterator[Row]], given: argparse.Namespace) -> bool:
    """Print the median of each figure, and the extremes of the wall time; return True."""
    for what, figures, shown in measure(given.runs):
        medians = [statistics.median(each) for each in zip(*figures, strict=True)]
        walls = [each[0] for each in figures]
        extremes = f"{min(walls):.2f} to {max(walls):.2f} s in {len(figures)} runs"
        print(f"{what}: {shown.format(*medians)}; {extremes}, load {os.getloadavg()[0]:.0f}", flush=True)
    return True


def main() -> None:
    """Print the figures; exit with 1 if a limit is exceeded."""
    starts = {"demo": demo, "help": help_texts, "server": robot_server, "component": component}
    measured = {"keys": print_keys, "run": print_run}
    measured |= {name: partial(print_start, each) for name, each in starts.items()}
    if chromium_path() is None:
        print(NO_CHROMIUM)
        del measured["run"]
    sys.exit(not all(parts(__doc__, measured, runs=5, keys=8, burners=0)))


if __name__ == "__main__":
    main()
