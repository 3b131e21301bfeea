"""Measure Run and STOP of the editor's page, from the key to a simulated robot in a separate process.

`run` is the time from F5 until the canvas shows the first live state. `latched` is the time from STOP until
the robot's emergency stop is latched, as another client sees it; `shown` that until the page no longer says
that the component runs, `ended` that until it says how it ended. Each is measured with a component that is
silent, and with one that prints without end. The figures are medians, and the worst in brackets.

    python benchmarks/bench_run_and_stop.py [--runs 9] [--burners 10]

`--burners` adds processes that take all processor time that they get.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Final

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from playwright.sync_api import Page

from benchmarks.bench_canvas import optimized_chromium
from benchmarks.bench_editor import server
from interfaces.nao import SafetyPrx, SafetyState
from tests.support.browser import NO_CHROMIUM, chromium_path
from tests.support.processes import ComponentProcess, free_endpoint, module
from zenoh_ice import Sample, initialize

REALM: Final = "bench"
LIMIT: Final = 60.0  # s for each event

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


@contextmanager
def burners(count: int) -> Iterator[None]:
    """Keep the processors busy within the block."""
    processes = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(count)]
    try:
        yield
    finally:
        for process in processes:
            process.kill()
        for process in processes:
            process.wait()


def once(page: Page, safety: SafetyPrx, latched: list[float], *, seconds: float) -> dict[str, float]:
    """Run the component, press STOP some seconds later, and reset the robot; return times in ms."""
    page.keyboard.press("F5")
    page.wait_for_function("() => window.first.run", timeout=LIMIT * 1000)
    page.wait_for_timeout(seconds * 1000)
    latched.clear()
    page.keyboard.press("Control+Shift+Space")
    page.wait_for_function("() => window.first.ended", timeout=LIMIT * 1000)
    end = time.monotonic() + LIMIT
    while not latched:
        if time.monotonic() > end:
            sys.exit("the robot did not stop")
        time.sleep(0.01)
    first = page.evaluate("() => window.first")
    safety.resetEmergencyStop()
    page.get_by_role("alert").filter(has_text="The robot is stopped").wait_for(
        state="detached", timeout=LIMIT * 1000
    )
    return {
        "run": first["run"] - first["f5"],
        "latched": latched[0] * 1000 - first["stop"],
        "shown": first["shown"] - first["stop"],
        "ended": first["ended"] - first["stop"],
    }


def measure(code: str, runs: int, load: int) -> list[dict[str, float]]:
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


def main() -> None:
    """Parse the options, measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--runs", type=int, default=9)
    parser.add_argument("--burners", type=int, default=0)
    options = parser.parse_args()
    if chromium_path() is None:
        sys.exit(NO_CHROMIUM)
    for name, code in CODES.items():
        found = measure(code, options.runs, options.burners)
        print(f"{name}, {options.burners} burners, load {os.getloadavg()[0]:.1f}")
        for figure in found[0]:
            values = [each[figure] for each in found]
            print(f"  {figure:10} {statistics.median(values):6.0f} ms ({max(values):.0f})")


if __name__ == "__main__":
    main()
