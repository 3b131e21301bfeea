"""Measure the monitor in the page: the delay until a state change is visible, and the cost of following.

A component of 20 automata, each of which changes its state twice a second, runs with the fake robot, and
Chromium follows it on the canvas with software rendering. `seen` is the time from the code of the new state
in the component until the frame that shows it; `server` is the processor time of the editor's server as a
share of a core, and `rate` the number of snapshots per second in the page.

    python benchmarks/bench_monitor.py [--seconds 20]
"""

from __future__ import annotations

import argparse
import re
import statistics
import sys
import tempfile
from pathlib import Path
from typing import Any, Final

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import psutil
from playwright.sync_api import Page

from benchmarks.bench_live import AUTOMATA, crowd
from codegen.diagnostics import Diagnostics
from codegen.hfsm import write_document
from tests.support.browser import chromium
from tests.support.processes import ComponentProcess, free_endpoint, module
from visualhfsm._document.generate import generate_component

SEEN: Final = 150.0
"""The largest median delay in ms until a change is visible."""
SHARE: Final = 0.15
"""The largest share of a core for the server."""
WARM_UP: Final = 3.0

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


def share_of(process: psutil.Process, seconds: float, page: Page) -> tuple[dict[str, Any], float]:
    """Return the measurement of the page, and the share of a core that the process took meanwhile."""
    before = process.cpu_times()
    found: dict[str, Any] = page.evaluate(_FOLLOW, seconds)
    after = process.cpu_times()
    return found, (after.user + after.system - before.user - before.system) / seconds


def main() -> None:
    """Print the figures; exit with 1 if a limit is exceeded."""
    parser = argparse.ArgumentParser(description=re.sub(r"\n.*", "", __doc__ or ""))
    parser.add_argument("--seconds", type=float, default=20.0)
    seconds = parser.parse_args().seconds
    endpoint = free_endpoint()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "crowd.xml")
        # The page has only the wall clock.
        text = write_document(crowd()).replace("time.monotonic()", "time.time()")
        path.write_text(text, encoding="utf-8")
        component = generate_component(path, None, Diagnostics())
        assert component is not None
        edit = ("edit", str(path), "--root", folder, "--no-browser", "--connect", endpoint)
        with (
            ComponentProcess(module("naoserver.fake", "--listen", endpoint)) as robot,
            ComponentProcess([sys.executable, str(component), "--connect", endpoint, "--clock", "wall"]),
            ComponentProcess(module("visualhfsm", *edit), {"XDG_STATE_HOME": folder}) as editor,
            chromium() as browser,
        ):
            robot.wait_for("ready")
            address = editor.wait_for(r"The editor is at (\S+)")[1]
            page = browser.new_page(viewport={"width": 1280, "height": 800})
            page.goto(address)
            page.get_by_role("button", name="1 running").click()
            page.get_by_role("menuitem", name="crowd").click()
            page.locator(".live-status.running").wait_for()
            page.wait_for_timeout(1000 * WARM_UP)
            found, share = share_of(psutil.Process(editor.process.pid), seconds, page)
            page.close()
    late = sorted(found["late"])
    seen = statistics.median(late)
    print(
        f"{AUTOMATA} automata: change seen after {seen:.0f} ms in the median (at most {SEEN:g} ms), "
        f"95 % below {late[int(0.95 * len(late))]:.0f} ms, of {len(late)}; "
        f"{found['rate']:.0f} snapshots/s, "
        f"{found['pictures']:.0f} pictures/s; server {share:.1%} of a core (at most {SHARE:.0%})"
    )
    sys.exit(int(seen > SEEN or share > SHARE))


if __name__ == "__main__":
    main()
