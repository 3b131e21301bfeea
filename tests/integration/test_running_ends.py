"""However the code of a document ends its component, the end leads to the place in the drawing."""

from __future__ import annotations

import asyncio
import os
import re
import signal
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import pytest

from codegen.diagnostics import Diagnostics
from codegen.hfsm import read_document
from hfsm_runtime import waiting
from tests.support.documents import document, state, sub, transition
from tests.support.limits import CALL_LIMIT, FOREVER, START_LIMIT
from tests.support.processes import children, free_endpoint
from tests.support.pushes import Pushes
from tests.support.soak import cases
from visualhfsm._document.places import Place
from visualhfsm._monitor.messages import USUAL_LIMITS, Output, PartLimits, Source, StartedPush
from visualhfsm._processes.components import StartedComponents
from zenoh_ice import Settings

CODE = Place(kind="state", automaton=2, id=5, part="code")
GUARD = Place(kind="transition", automaton=2, id=3, part="trigger")
FUNCTIONS = Place(kind="automaton", automaton=2, part="functions")
VARIABLES = Place(kind="automaton", automaton=2, part="variables")
LIBRARY = Place(kind="document", part="libraries", index=1, name="name")


def text(
    code: str = "", guard: str = "False", functions: str = "", variables: str = "", library: str = "json"
) -> str:
    """Return a document whose automaton 2 reaches its state 5, `deep`, after a cycle."""
    below = sub(
        2,
        1,
        state(4, "first", initial=True),
        state(5, "deep", code),
        state(6, "last"),
        transition(2, 4, 5, "20", type="time"),
        transition(3, 5, 6, guard),
        functions=functions,
        variables=variables,
        period="20",
    )
    root = sub(1, 0, state(1, "here", initial=True, child=2), period="20")
    return document(root, below, libraries=("math", library))


def end_of(
    path: Path,
    content: str,
    *,
    dry_run: bool = False,
    kill: int = 0,
    stop: bool = False,
    ahead: bool = False,
    limits: PartLimits = USUAL_LIMITS,
) -> tuple[StartedPush, str]:
    """Run a document, perhaps kill or stop it when it prints its pid; return how it ended, and its output.

    It runs in a process that was started `ahead`, or in a new one.
    """
    path.write_text(content)
    found = read_document(path, Diagnostics())
    assert found is not None

    async def go() -> tuple[StartedPush, str]:
        pushes = Pushes()

        def output() -> str:
            return "\n".join(line.text for push in pushes.of(Output) for line in push.lines)

        settings = Settings(realm="test-ends", connect=(free_endpoint(),), timeout=CALL_LIMIT)
        service = StartedComponents(
            pushes, settings, limits=replace(limits, preparation=FOREVER * (not ahead))
        )
        try:
            if ahead:
                service.prepare()
                async with asyncio.timeout(START_LIMIT):
                    while not children(waiting.__file__):
                        await asyncio.sleep(0.01)
            await service.start(
                Source(1, 1, found, path, False), ["--clock", "wall"], dry_run="" if dry_run else None
            )
            if kill:
                pid = await pushes.until(lambda: re.search(r"pid (\d+)", output()))
                os.kill(int(pid[1]), kill)
            ended = asyncio.create_task(pushes.next(StartedPush, lambda push: push.status == "ended"))
            if stop:
                await pushes.until(lambda: "pid" in output())
                await service.stop(1, "viewer")
            end = await ended
        finally:
            await service.close()
        return end, output()

    return asyncio.run(go())


class End(NamedTuple):
    """What a document does, and how it ends: the exit code, where, and what the output says."""

    parts: dict[str, str]
    code: int
    place: Place
    line: int
    says: str


ENDS = {
    "sys.exit": End({"code": "import sys\nsys.exit(3)"}, 3, CODE, 2, r"deep: sys\.exit\(3\) ends the component"),
    "exit in a guard": End({"guard": "exit('enough')"}, 1, GUARD, 1, r"deep: sys\.exit\('enough'\) ends"),
    "os._exit in a function": End(
        {"functions": "def f(self):\n    import os\n    os._exit(4)", "code": "self.f()"},
        4, FUNCTIONS, 3, r"deep: os\._exit\(4\) ends the process .*; a final state ends it in order",
    ),
    "os._exit(0)": End({"code": "import os\nos._exit(0)"}, 0, CODE, 2, r"deep: os\._exit\(0\) ends the process"),
    "abort": End({"code": "import os\nos.abort()"}, -signal.SIGABRT, CODE, 2, r"deep: os\.abort\(\) ends"),
    "crash": End({"code": "import ctypes\nctypes.string_at(0)"}, -signal.SIGSEGV, CODE, 2, "Segmentation fault"),
    "kills itself": End(
        {"code": "import os\nos.kill(os.getpid(), 9)"}, -signal.SIGKILL, CODE, 2, r"deep: os\.kill\(\d+, 9\)"
    ),
    "import": End({"code": "x = 1\nimport no_such"}, 1, CODE, 2, "try `pip install no_such`"),
    "variables": End({"variables": "import sys\nsys.exit(5)"}, 1, VARIABLES, 2, "the variables .* SystemExit: 5"),
    "missing library": End({"library": "no_such"}, 1, LIBRARY, 1, "the library no_such is not installed: try `pip"),
    "library that exits": End({"library": "exits"}, 6, LIBRARY, 1, r"a library ends the program .* by sys\.exit\(6\)"),
    "library that leaves": End({"library": "leaves"}, 1, LIBRARY, 1, r"a library ends the program .* by sys\.exit\(None\)"),
    "library that dies": End({"library": "dies"}, 7, LIBRARY, 1, r"os\._exit\(7\) ends the process"),
    "library that fails": End({"library": "fails"}, 1, LIBRARY, 1, "ValueError: it fails"),
}  # fmt: skip


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """Return where a document belongs, beside libraries that end the program."""
    (tmp_path / "exits.py").write_text("raise SystemExit(6)\n")
    (tmp_path / "leaves.py").write_text("raise SystemExit\n")
    (tmp_path / "dies.py").write_text("import os\nos._exit(7)\n")
    (tmp_path / "fails.py").write_text("raise ValueError('it fails')\n")
    return tmp_path / "ends.xml"


@pytest.mark.parametrize("expected", ENDS.values(), ids=ENDS)
def test_what_ends_a_component_is_found_in_the_document(path: Path, expected: End) -> None:
    end, output = end_of(path, text(**expected.parts))
    assert re.search(expected.says, output), output
    assert (end.exit_code, end.place, end.line) == (expected.code, expected.place, expected.line), output


@pytest.mark.parametrize(
    "name", cases(["os._exit(0)", "missing library"], ["kills itself", "library that dies"])
)
def test_what_ends_one_that_was_started_ahead_is_found_there_too(path: Path, name: str) -> None:
    expected = ENDS[name]
    end, output = end_of(path, text(**expected.parts), ahead=True)
    assert re.search(expected.says, output), output
    assert (end.exit_code, end.place, end.line) == (expected.code, expected.place, expected.line), output


@pytest.mark.parametrize(
    "name", cases(["os._exit(0)", "library that exits"], ["sys.exit", "missing library"])
)
def test_what_ends_a_dry_run_is_found_there_too(path: Path, name: str) -> None:
    expected = ENDS[name]
    end, output = end_of(path, text(**expected.parts), dry_run=True)
    assert re.search(expected.says, output), output
    assert "Traceback" not in output
    assert (end.place, end.line) == (expected.place, expected.line)


@pytest.mark.parametrize(
    ("code", "running"), [("import time\ntime.sleep(600)", "during"), ("", "after")], ids=["busy", "idle"]
)
def test_a_process_that_is_killed_leads_to_the_state_whose_cycle_was_the_last(
    path: Path, code: str, running: str
) -> None:
    """Nothing in the process can report this."""
    printing = "import os\nprint('pid', os.getpid(), flush=True)"
    end, output = end_of(path, text(f"{printing}\n{code}"), kill=signal.SIGKILL)
    assert end.exit_code == -signal.SIGKILL, output
    if running == "during":
        assert end.place == Place(kind="state", automaton=2, id=5)
        assert end.message.endswith("because memory ran out, during a cycle in the state deep")
    else:  # another automaton may be the last one
        assert end.place in {Place(kind="state", automaton=2, id=5), Place(kind="state", automaton=1, id=1)}
        assert "by SIGKILL, by somebody or because memory ran out" in end.message


@pytest.mark.slow
def test_a_stop_of_code_that_lets_no_other_code_run_leads_to_its_state(path: Path) -> None:
    limits = PartLimits(interruption=0.1, termination=0.1)
    holds_the_interpreter = "import ctypes\nprint('pid', flush=True)\nctypes.PyDLL(None).sleep(600)"
    end, output = end_of(path, text(holds_the_interpreter), stop=True, limits=limits)
    assert end.exit_code == -signal.SIGKILL, output
    assert (end.message, end.elsewhere) == (
        "it was stopped while hanging in deep",
        "it was stopped by a viewer while hanging in deep",
    )
    assert end.place == Place(kind="state", automaton=2, id=5)


def test_code_that_a_transition_runs_leads_to_the_transition(path: Path) -> None:
    code = "import os, time\nprint('pid', os.getpid(), flush=True)\ntime.sleep(600)"
    content = text(guard="True").replace("<transcode></transcode>", f"<transcode>{code}</transcode>")
    end, output = end_of(path, content, kill=signal.SIGKILL)
    assert end.place == Place(kind="transition", automaton=2, id=2), output


def test_an_orderly_end_leads_nowhere_and_leaves_no_file(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    temporary = path.with_name("temporary")
    temporary.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(temporary))
    end, output = end_of(path, text("import sys\nsys.exit()"))
    assert (end.exit_code, end.place, end.message) == (0, None, "it has finished")
    assert re.search(r"WARNING .*/deep: sys\.exit\(\) ends the component at ", output), output
    assert list(temporary.iterdir()) == []


def test_a_process_that_user_code_forks_ends_as_it_likes(path: Path) -> None:
    code = (
        "import os, sys\nchild = os.fork()\nif not child:\n    os._exit(0)\nos.waitpid(child, 0)\nsys.exit()"
    )
    end, output = end_of(path, text(code))
    assert (end.exit_code, end.place) == (0, None)
    assert "os._exit" not in output
