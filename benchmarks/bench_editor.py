"""Measure the editor's page in Chromium with software rendering: time until it is usable, and drawing speed.

`usable` is the time from the navigation until the first state is drawn, `transferred` the data until then.
`canvas` is the time from a command to the new state in the drawing, `command` that to the next frame with
it, in a document of 300 states and 600 transitions. `drag` counts the frames per second while one state, or
all of them, are dragged on that canvas; `wheel` does so while it is zoomed in each frame.
`open` is the time from the request for a document of 2000 states to the frame with all of them.

    python benchmarks/bench_editor.py [--states 300] [--transitions 600] [--large 2000]
"""

from __future__ import annotations

import argparse
import os
import random
import re
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from playwright.sync_api import Browser, Page

from tests.support.browser import NO_CHROMIUM, chromium, chromium_path

ROOT: Final = Path(__file__).resolve().parents[1]
LIMITS: Final = {
    "usable (s)": 0.5,
    "transferred (kB)": 150.0,
    "canvas (ms)": 16.0,
    "command (ms)": 30.0,
    "drag of one (1/s)": 30.0,
    "drag of all (1/s)": 30.0,
    "wheel (1/s)": 30.0,
    "open (s)": 2.0,
}
"""The limits: upper ones, and lower ones for rates."""

COMMANDS: Final = 30
LOADS: Final = 5
DRAG_SECONDS: Final = 3.0
WHEEL_SECONDS: Final = 3.0
ENDING: Final = 10.0  # s within which the server must end

_WATCH_FIRST_STATE: Final = """
const look = () => {
    if (document.querySelector('.state')) window.usable = performance.now();
    else requestAnimationFrame(look);
};
requestAnimationFrame(look);
"""
MODULE: Final = """
const module = (name) => import([...document.querySelectorAll('link[rel=modulepreload]')]
    .find((link) => link.href.endsWith('/data/commands.js')).href.replace('data/commands.js', `${name}.js`));
const painted = () => new Promise((done) => requestAnimationFrame(() => setTimeout(done)));
"""


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


@contextmanager
def opened(browser: Browser, address: str) -> Iterator[Page]:
    """Open the editor in a browser window."""
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    try:
        page.goto(address)
        yield page
    finally:
        page.close()


def measure_loading(browser: Browser, root: Path) -> dict[str, float]:
    """Return the time until the page shows the first state, and the amount of data received by then."""
    times, sizes = [], []
    with server(root, "small.xml") as address:
        session = browser.new_context()
        session.new_page().goto(address)  # the token is valid once
        for _ in range(LOADS):
            context = browser.new_context(storage_state=session.storage_state())
            page = context.new_page()
            page.add_init_script(_WATCH_FIRST_STATE)
            page.goto(address.split("?")[0])
            page.wait_for_selector(".state")
            times.append(page.evaluate("window.usable") / 1000)
            sizes.append(
                page.evaluate(
                    "['navigation', 'resource'].flatMap((kind) => performance.getEntriesByType(kind))"
                    ".reduce((sum, entry) => sum + entry.transferSize, 0)"
                )
                / 1000
            )
            context.close()
        session.close()
    return {"usable (s)": statistics.median(times), "transferred (kB)": max(sizes)}


def measure_drawing(page: Page) -> dict[str, float]:
    """Return how fast the page draws a command and a drag."""
    page.wait_for_selector(".state")
    page.wait_for_timeout(2000)  # until the first checks have finished
    times: list[tuple[float, float]] = page.evaluate(
        f"""async () => {{ {MODULE}
            const {{apply}} = await module('data/commands');
            const circles = document.querySelector('.circles');
            const times = [];
            for (let number = 0; number < {COMMANDS}; number++) {{
                const began = performance.now();
                const drawn = new Promise((done) => {{
                    const observer = new MutationObserver(() => {{ observer.disconnect(); done(); }});
                    observer.observe(circles, {{childList: true}});
                }});
                apply('addState', {{automaton: 1, x: number * 100, y: -200}});
                await drawn;
                const changed = performance.now() - began;
                await painted();
                times.push([changed, performance.now() - began]);
                await new Promise((done) => setTimeout(done, 100));
            }}
            return times;
        }}"""
    )
    one = drag(page)
    page.keyboard.press("Escape")
    page.keyboard.press("Control+a")
    return {
        "canvas (ms)": statistics.median(changed for changed, _ in times),
        "command (ms)": statistics.median(painted for _, painted in times),
        "drag of one (1/s)": one,
        "drag of all (1/s)": drag(page),
        "wheel (1/s)": turn_wheel(page),
    }


def turn_wheel(page: Page) -> float:
    """Zoom in and out by a factor of 3 around the middle, in each frame; return the frames per second."""
    page.keyboard.press("Escape")
    page.keyboard.press("f")
    rate: float = page.evaluate(
        f"""async () => {{
            const surface = document.querySelector('hfsm-canvas .surface');
            const {{left, top, width, height}} = surface.getBoundingClientRect();
            const [clientX, clientY] = [left + width / 2, top + height / 2];
            const began = performance.now();
            let frames = 0;
            for (let now = began; now < began + {1000 * WHEEL_SECONDS}; frames++) {{
                const deltaY = frames % 32 < 16 ? -10 : 10;
                const options = {{clientX, clientY, deltaY, ctrlKey: true, bubbles: true, cancelable: true}};
                surface.dispatchEvent(new WheelEvent('wheel', options));
                now = await new Promise(requestAnimationFrame);
            }}
            return 1000 * frames / (performance.now() - began);
        }}"""
    )
    return rate


def drag(page: Page) -> float:
    """Drag a state in the middle back and forth; return the frames per second."""
    circles = page.locator(".state .body")
    box = circles.nth(circles.count() // 2).bounding_box()
    assert box is not None
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 8, y + 8)
    page.evaluate(
        "() => { window.pictures = 0; window.began = performance.now();"
        " const count = () => { pictures++; requestAnimationFrame(count); }; requestAnimationFrame(count); }"
    )
    ends = time.monotonic() + DRAG_SECONDS
    step = 0
    while time.monotonic() < ends:
        step += 1
        page.mouse.move(x + step % 40, y + step % 30)
    rate: float = page.evaluate("1000 * pictures / (performance.now() - began)")
    page.keyboard.press("Escape")
    page.mouse.up()
    return rate


def measure_opening(page: Page, states: int) -> dict[str, float]:
    """Return the time from the request for a large document until it is drawn."""
    page.get_by_role("button", name="Open a document").wait_for()
    duration: float = page.evaluate(
        f"""async () => {{ {MODULE}
            const {{openPath}} = await module('data/files');
            const began = performance.now();
            await openPath('large.xml');
            const {{drawing}} = document.querySelector('hfsm-canvas');
            while (drawing.states.size < {states} || !document.querySelector('.state')) await painted();
            await painted();
            return performance.now() - began;
        }}"""
    )
    return {"open (s)": duration / 1000}


def main() -> None:
    """Parse the options, measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--states", type=int, default=300)
    parser.add_argument("--transitions", type=int, default=600)
    parser.add_argument("--large", type=int, default=2000)
    options = parser.parse_args()
    if chromium_path() is None:
        sys.exit(NO_CHROMIUM)
    with tempfile.TemporaryDirectory() as directory, chromium() as browser:
        root = Path(directory)
        (root / "small.xml").write_text(grid(4, 6))
        (root / "medium.xml").write_text(grid(options.states, options.transitions))
        (root / "large.xml").write_text(grid(options.large, 2 * options.large))
        found = measure_loading(browser, root)
        with server(root, "medium.xml") as address, opened(browser, address) as page:
            found |= measure_drawing(page)
        with server(root) as address, opened(browser, address) as page:
            found |= measure_opening(page, options.large)
    fine = True
    for name, value in found.items():
        limit = LIMITS[name]
        kept = value >= limit if "1/s" in name else value <= limit
        fine = fine and kept
        print(f"  {name:20} {value:8.2f}   limit {limit:g}{'' if kept else '   EXCEEDED'}")
    sys.exit(not fine)


if __name__ == "__main__":
    main()
