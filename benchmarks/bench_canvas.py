"""Measure how smoothly the canvas moves a large drawing, in Chromium with software rendering.

In automata of 300 and 3000 states, with twice as many transitions, each gesture is made with real events of
the mouse, the wheel or two fingers: once on the whole drawing (`far`), once at its own size (`near`). `drag`
moves a state, `wheel` zooms in and out by a factor of 7, `pan` drags with the middle button, `pinch` moves
two fingers. Printed are the frames per second and the longest time between two frames, as medians of several
runs, and before them `open`, the time from the request for the document until it is drawn, and `show`, the
same for an open one.

    python benchmarks/bench_canvas.py [--states 300 3000] [--runs 3] [--beside CHECKOUT]

With `--beside`, the editor of another checkout is measured in turn, run by run, on the same machine.
"""

from __future__ import annotations

import argparse
import itertools
import os
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Final, NamedTuple

from playwright.sync_api import CDPSession, Page

from benchmarks.bench_editor import MODULE, grid, optimized_chromium, server
from tests.support.browser import NO_CHROMIUM, chromium_path
from tests.support.places import ROOT

SECONDS: Final = 2.5
PACE: Final = 1 / 60  # s between two events
NOTCH: Final = 120
NOTCHES: Final = 10  # of the wheel in one direction

_COUNT_FRAMES: Final = """() => {
    window.frames_ = [];
    window.counting = true;
    const count = (now) => { window.frames_.push(now); if (window.counting) requestAnimationFrame(count); };
    requestAnimationFrame(count);
}"""
_FRAMES: Final = "() => { window.counting = false; return window.frames_; }"


class Smoothness(NamedTuple):
    """What one run of a gesture came to."""

    rate: float  # frames per second
    worst: float  # ms between two frames


Gesture = Callable[[Page, CDPSession, float, float], None]
"""Makes a gesture that begins at a point of the window."""


def paced() -> Iterator[int]:
    """Count events of one gesture, at their pace until its time is over."""
    began = time.monotonic()
    for step in itertools.count():
        due = began + step * PACE
        if due > began + SECONDS:
            return
        time.sleep(max(0.0, due - time.monotonic()))
        if time.monotonic() > began + SECONDS:
            return
        yield step


def drag(page: Page, _devtools: CDPSession, x: float, y: float) -> None:
    """Drag the state at a point to and fro."""
    page.mouse.move(x, y)
    page.mouse.down()
    for step in paced():
        page.mouse.move(x + 8 + step % 40, y + 8 + step % 30)
    page.keyboard.press("Escape")
    page.mouse.up()


def wheel(page: Page, _devtools: CDPSession, x: float, y: float) -> None:
    """Zoom in and out."""
    page.mouse.move(x, y)
    for step in paced():
        if step % 2 == 0:
            page.mouse.wheel(0, -NOTCH if step // 2 % (2 * NOTCHES) < NOTCHES else NOTCH)


def pan(page: Page, _devtools: CDPSession, x: float, y: float) -> None:
    """Drag the drawing with the middle button, in a triangle of 600 pixels."""
    page.mouse.move(x, y)
    page.mouse.down(button="middle")
    for step in paced():
        there = abs(step % 80 - 40) * 15 - 300
        page.mouse.move(x + there, y + there / 2)
    page.mouse.up(button="middle")


def pinch(_page: Page, devtools: CDPSession, x: float, y: float) -> None:
    """Move two fingers apart and together again."""

    def touch(kind: str, spread: float) -> None:
        points = [{"x": x + side * spread, "y": y, "id": side + 1} for side in (-1, 1)]
        devtools.send(
            "Input.dispatchTouchEvent", {"type": kind, "touchPoints": points if kind != "touchEnd" else []}
        )

    touch("touchStart", 60)
    for step in paced():
        touch("touchMove", 60 * 1.05 ** (40 - abs(step % 80 - 40)))
    touch("touchEnd", 0)


GESTURES: Final[dict[str, Gesture]] = {"drag": drag, "wheel": wheel, "pan": pan, "pinch": pinch}


def smoothness(page: Page, devtools: CDPSession, gesture: Gesture, x: float, y: float) -> Smoothness:
    """Make a gesture and look at its frames."""
    page.wait_for_timeout(700)  # until the page rests
    page.evaluate(_COUNT_FRAMES)
    gesture(page, devtools, x, y)
    times: list[float] = page.evaluate(_FRAMES)
    spans = [after - before for before, after in itertools.pairwise(times)]
    return Smoothness(1000 * len(spans) / (times[-1] - times[0]), max(spans))


def middle_state(page: Page) -> tuple[float, float]:
    """Return where the state is in the window that is nearest to the middle of the canvas."""
    x, y = page.evaluate(
        """() => {
            const canvas = document.querySelector('hfsm-canvas');
            const {left, top, width, height} = canvas.getBoundingClientRect();
            const far = (place) => Math.hypot(place.x - width / 2, place.y - height / 2);
            const places = [...canvas.drawing.places].filter(([key]) => key.startsWith('s'))
                .map(([, place]) => canvas.viewport.toWindow(place));
            const {x, y} = places.reduce((a, b) => far(a) < far(b) ? a : b);
            return [left + x, top + y];
        }"""
    )
    return x, y


def measure(page: Page, gestures: list[str]) -> dict[str, float]:
    """Open the document, and make each gesture on it, far and near."""
    page.get_by_role("button", name="Open a document").wait_for()
    found: dict[str, float] = page.evaluate(
        f"""async () => {{ {MODULE}
            const {{openPath}} = await module('data/files');
            const {{page}} = await module('data/page');
            const drawn = async () => {{
                while (!document.querySelector('hfsm-canvas .state')) await painted();
                await painted();
                await painted();
            }};
            const began = performance.now();
            await openPath('large.xml');
            await drawn();
            const opened = performance.now();
            await new Promise((done) => setTimeout(done, 3000));  // until it is checked
            const tab = page.tab;
            page.show(0);
            await painted();
            await painted();
            const back = performance.now();
            page.show(tab);
            await painted();
            await drawn();
            return {{'open (ms)': opened - began, 'show (ms)': performance.now() - back}};
        }}"""
    )
    devtools = page.context.new_cdp_session(page)
    for where in ("far", "near"):
        for name in gestures:
            page.keyboard.press("Escape")
            page.keyboard.press("f")
            if where == "near":
                x, y = middle_state(page)
                page.mouse.click(x, y)
                page.keyboard.press("Shift+f")
                page.keyboard.press("Escape")
            x, y = middle_state(page)
            result = smoothness(page, devtools, GESTURES[name], x, y)
            found[f"{name} {where} (1/s)"] = result.rate
            found[f"{name} {where}, worst (ms)"] = result.worst
    return found


def measured(checkout: Path, states: int, gestures: list[str]) -> dict[str, float]:
    """Measure the editor of a checkout once, in a new browser."""
    with tempfile.TemporaryDirectory() as directory:
        root = Path(directory)
        (root / "large.xml").write_text(grid(states, 2 * states))
        with server(root, checkout=checkout) as address, optimized_chromium() as browser:
            page = browser.new_page(viewport={"width": 1280, "height": 800}, has_touch=True)
            page.goto(address)
            return measure(page, gestures)


def main() -> None:
    """Parse the options, measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--states", type=int, nargs="+", default=[300, 3000])
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--gestures", nargs="+", choices=GESTURES, default=list(GESTURES))
    parser.add_argument("--beside", type=Path, help="another checkout, measured in turn")
    options = parser.parse_args()
    if chromium_path() is None:
        sys.exit(NO_CHROMIUM)
    checkouts = [ROOT, *([options.beside.resolve()] if options.beside else [])]
    for states in options.states:
        runs: list[list[dict[str, float]]] = [[] for _ in checkouts]
        for _ in range(options.runs):
            for checkout, results in zip(checkouts, runs, strict=True):
                results.append(measured(checkout, states, options.gestures))
        print(f"{states} states, load {os.getloadavg()[0]:.1f}")
        for name in runs[0][0]:
            medians = [statistics.median(run[name] for run in results) for results in runs]
            print(f"  {name:24}" + "".join(f"{value:10.0f}" for value in medians))


if __name__ == "__main__":
    main()
