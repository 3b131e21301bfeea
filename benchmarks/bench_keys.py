"""Measure what happens in the page's server between a key and an answer: functions, processor and wall time.

`key` is a key in the code field that makes a mistake, until the problem of its red line is sent; `F5` is a
dry run until the first moment of the component, not the first one of a document. Functions are those of
Python in this repository that the server's process runs, each once, with the number of their files; of F5
only those of the editor, and without what it does all the time. Times are medians, of the server's process
and its children together, in `score.xml` and in a document of 40 automata made of it; wall time counts from
the end of the pause of typing.

    python benchmarks/bench_keys.py [--checkout FOLDER] [--keys 8] [--list]
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:  # imported from the checkout
    from collections.abc import Callable

    from tests.support.editor import Window
    from visualhfsm._editor.parts import Parts
    from visualhfsm._monitor.messages import Publish

ROOT: Final = Path(__file__).resolve().parents[1]
QUIET: Final = 0.03  # s, the pause of typing
AUTOMATA: Final = 40
MISTAKES: Final = {"syntax": "self.foo({turn}", "name": "unknown_{turn} + 1"}
_HIDDEN: Final = ("/tests/", "/.venv/", "/benchmarks/")

SMALL: Final = """<VisualHFSM><SubAutomata id="1" idFather="0"><state initial="true" id="1"><posx>100</posx>
<posy>100</posy><name>wait</name><code>pass</code></state></SubAutomata></VisualHFSM>
"""


class Passed:
    """The functions that were called while it counts."""

    def __init__(self, checkout: Path) -> None:
        self._root = f"{checkout}/"
        self._counts = False
        self.found: set[tuple[str, str]] = set()

    def __call__(self, frame: FrameType, event: str, _: object) -> None:
        """Take a call, as a function for `threading.setprofile`."""
        code = frame.f_code
        name = code.co_filename
        is_ours = name.startswith(self._root) and not any(part in name for part in _HIDDEN)
        if self._counts and event == "call" and is_ours and not code.co_name.startswith("<"):
            self.found.add((name.removeprefix(self._root), code.co_qualname))

    @contextmanager
    def counting(self) -> Iterator[None]:
        """Count within a `with` block."""
        self.found = set()
        self._counts = True
        try:
            yield
        finally:
            self._counts = False


def forty(path: Path) -> str:
    """Return a document of 40 automata: one above copies of that of a file."""
    from codegen.diagnostics import Diagnostics
    from codegen.hfsm import read_document, write_document
    from codegen.hfsm.document import State, Text, Transition

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


@contextmanager
def edited(text: str, parts: Callable[[Publish, Path], Parts] | None = None) -> Iterator[tuple[Window, int]]:
    """Open a document in an editor, and yield its window, and the number of the tab."""
    from tests.support.editor import editor, no_parts
    from visualhfsm._editor.limits import Limits

    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder) / "project"
        root.mkdir()
        (root / "a.xml").write_text(text)
        limits = Limits(quiet_seconds=QUIET, file_check_seconds=3600.0, operation_seconds=60.0)
        make = (lambda publish: parts(publish, root)) if parts else no_parts
        with (
            editor(root, root / "a.xml", limits=limits, make_parts=make, port=0) as running,
            running.window() as window,
        ):
            yield window, 1


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


def count_key(passed: Passed) -> set[tuple[str, str]]:
    """Return the functions from the third key to its red line."""
    place = place_in(1)
    with edited(SMALL) as (window, tab):
        time.sleep(1.0)
        red_line(window, tab, place, "self.(")
        for turn in range(3):
            settle(window, tab, place, "pass")
            time.sleep(0.5)
            with passed.counting():
                red_line(window, tab, place, MISTAKES["syntax"].format(turn=turn))
                time.sleep(0.2)
    return passed.found


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


def count_run(passed: Passed) -> tuple[set[tuple[str, str]], float]:
    """Return the functions of the editor from F5 to the first moment, and the wall time of that in s."""
    from visualhfsm._editor.parts import make_parts
    from zenoh_ice.settings import Settings

    def parts(publish: Publish, root: Path) -> Parts:
        shared = root.with_name("shared")
        shared.mkdir(mode=0o700, exist_ok=True)
        return make_parts(Settings(realm=f"keys-{os.getpid()}"), (), root, shared)(publish)

    took = []
    with edited(SMALL, parts=parts) as (window, tab):
        time.sleep(6.0)
        with passed.counting():
            time.sleep(4.0)
        idle = passed.found
        for _turn in range(4):
            window.pushes.clear()
            at = time.monotonic()
            with passed.counting():
                window.ask("start", tab=tab, arguments=[], dryRun=True, body="H25")
                window.wait_for(lambda message: message.get("push") == "snapshot")
            took.append(time.monotonic() - at)
            found = passed.found - idle
            time.sleep(1.0)
            window.ask("stop", tab=tab)
            time.sleep(1.0)
    own = {each for each in found if not each[0].startswith(("codegen/", "zenoh_ice/"))}
    return own, statistics.median(took[1:])


def show(what: str, found: set[tuple[str, str]], *, listed: bool) -> None:
    """Print the number of functions and files."""
    files: dict[str, list[str]] = {}
    for file, name in sorted(found):
        files.setdefault(file, []).append(name)
    print(f"  {what:42} {len(found):4} functions in {len(files)} files", flush=True)
    for file, names in files.items() if listed else ():
        print(f"      {file}: {', '.join(names)}")


def main() -> None:
    """Parse the options, measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--checkout", type=Path, default=ROOT, help="the repository whose code is measured")
    parser.add_argument("--keys", type=int, default=8)
    parser.add_argument("--list", action="store_true", help="name the functions")
    parser.add_argument("--only", choices=("key", "F5", "time"), help="one of the measurements")
    options = parser.parse_args()
    checkout = options.checkout.resolve()
    sys.path.insert(0, str(checkout))
    os.environ["PYTHONPATH"] = str(checkout)  # for the children
    score = checkout / "behaviors" / "score.xml"
    if options.only in (None, "time"):
        for title, text, automaton in (
            ("score.xml", score.read_text(), 1),
            ("40 automata", forty(score), 20),
        ):
            for name, mistake in MISTAKES.items():
                used, waited = time_key(text, automaton, mistake, options.keys)
                what = f"key to red line, {title}, {name}"
                print(f"  {what:42} {1000 * used:6.0f} ms of processor, {1000 * waited:5.0f} ms", flush=True)
    passed = Passed(checkout)
    threading.setprofile(passed)
    if options.only in (None, "key"):
        show("key to red line", count_key(passed), listed=options.list)
    if options.only in (None, "F5"):
        found, took = count_run(passed)
        show("F5 to the first moment, the editor's", found, listed=options.list)
        print(f"  {'F5 to the first moment':42} {1000 * took:6.0f} ms")


if __name__ == "__main__":
    main()
