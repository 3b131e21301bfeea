"""Threads that the code of a document starts, and its callbacks: what ends them is an error of the component."""

from __future__ import annotations

import re
import sys
import threading
from pathlib import Path
from typing import Any
from weakref import WeakSet

import pytest

from hfsm_runtime import _own_threads
from hfsm_runtime._component_run import ComponentRun
from hfsm_runtime._runtime import Runtime
from hfsm_runtime.errors import OnError
from hfsm_runtime.virtual import BehaviorFailed, Execution
from interfaces.hfsm import ErrorReport
from interfaces.nao import SafetyPrx
from tests.support.documents import compile_to, document, load, state, sub
from tests.support.fast_clock import FastClock
from tests.support.limits import EVENT_LIMIT
from tests.support.waiting import until
from visualhfsm.testing import MakeBehavior
from zenoh_ice import WallClock

CODE = """if not self.threads:
    thread = threading.Thread(target={}, name="helper")
    thread.start()
    self.threads.append(thread)"""
FUNCTIONS = "threads = []\ndef work(self):\n    self.sleep(1000)"


MOTORS = """<iceinterface><nameinterface>Motors</nameinterface><nameproxy>motors</nameproxy>
<interface>Motors</interface></iceinterface>"""


def component(folder: Path, target: str) -> Any:  # the attributes are those of the document
    """Return a component, which may drive motors, whose code starts one thread."""
    root = sub(1, 0, state(1, "a", CODE.format(target), initial=True), functions=FUNCTIONS)
    return load(compile_to(folder, document(root, libraries=("threading",), config=MOTORS)))


def finished(made: Any) -> bool:
    return bool(made.threads) and not made.threads[0].is_alive()


FAILED = "the thread helper, which its code started, failed: ZeroDivisionError: division by zero"


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
@pytest.mark.parametrize("is_virtual", [True, False], ids=["virtual time", "threads"])
@pytest.mark.parametrize("others", [0, 1], ids=["alone", "beside another of the same document"])
@pytest.mark.parametrize("policy", OnError)
def test_an_exception_that_ends_a_thread_is_an_error_of_its_component(
    policy: OnError, others: int, is_virtual: bool, tmp_path: Path
) -> None:
    made = component(tmp_path, "lambda: self and 1 / 0")
    beside = [Runtime(type(made)(), FastClock()) for _ in range(others)]
    run: ComponentRun
    if is_virtual:
        with Execution(made, on_error=policy) as run:
            run.advance(0.1)
            made.threads[0].join(EVENT_LIMIT)
            run.advance(0.1)
            goes_on = not run.ended.is_set()
    else:
        run = Runtime(made, FastClock(), policy)
        run.start()
        try:
            until(lambda: finished(made) and run.errors)
            if policy is OnError.STOP:
                assert run.ended.wait(EVENT_LIMIT)
            goes_on = not run.ended.is_set()
        finally:
            run.stop()
    (error,) = run.errors
    assert error.message == FAILED
    assert error.location.endswith("(behavior.xml:4)")
    assert goes_on == (policy is OnError.CONTINUE)
    assert run.failed == (policy is OnError.STOP)
    assert not any(other.errors or other.ended.is_set() for other in beside)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_an_exception_that_ends_a_thread_fails_a_test_and_stops_the_robot(tmp_path: Path) -> None:
    made = component(tmp_path, "lambda: self.go.wait() and 1 / 0")
    made.go = threading.Event()
    with Execution(made, stubs={"motors": {"stop": None}}) as run:
        run.advance(0.1)
        made.go.set()
        made.threads[0].join(EVENT_LIMIT)
        with pytest.raises(BehaviorFailed, match=FAILED) as failure:
            run.advance(0.1)
        assert "behavior.xml:4" in str(failure.value)
        assert run.halted
        assert run.calls("motors.stop")


HEAD = """<iceinterface><nameinterface>Head</nameinterface><nameproxy>Head</nameproxy>
<interface>PoseHead</interface></iceinterface>"""
BODY = """<iceinterface><nameinterface>Body</nameinterface><nameproxy>Body</nameproxy>
<interface>Joints</interface></iceinterface>"""
FUTURE = "self.heard = self.Head.getPose.begin()\n    self.heard.add_done_callback(self.hear)"
STREAM = "self.heard = self.Head.getPose.subscribe(self.hear)"


@pytest.mark.parametrize("policy", [None, *OnError])
@pytest.mark.parametrize("code", [FUTURE, STREAM], ids=["of a call", "of a stream"])
def test_an_exception_in_a_callback_is_an_error_of_its_component(
    code: str, policy: OnError | None, behavior: MakeBehavior, tmp_path: Path
) -> None:
    hears = "heard = None\ndef hear(self, what):\n    1 / 0"
    root = sub(1, 0, state(1, "a", f"if not self.heard:\n    {code}", initial=True), functions=hears)
    made = load(compile_to(tmp_path, document(root, config=HEAD)))
    failed = "a callback of its code failed: ZeroDivisionError: division by zero"
    run = behavior(type(made), robot="fake", on_error=policy)
    if policy is None:
        with pytest.raises(BehaviorFailed, match=failed):
            run.advance(0.5)
    else:
        run.advance(0.5)
    (error,) = run.errors
    assert error.message == failed
    assert re.search(r"\(behavior.xml:\d+\)$", error.location)
    assert run.halted == bool(run.calls("Head.stop")) == (policy is not OnError.CONTINUE)


def following(folder: Path, behavior: MakeBehavior, stream: str = STREAM) -> Any:
    """Return a behavior whose callback of a stream commands the head."""
    follows = "heard = None\ndef hear(self, what):\n    self.Head.setPose(0.1, 0.0, 0.5)"
    root = sub(1, 0, state(1, "a", f"if not self.heard:\n    {stream}", initial=True), functions=follows)
    return behavior(type(load(compile_to(folder, document(root, config=HEAD + BODY)))), robot="fake")


def test_a_command_that_is_refused_to_a_callback_pauses_the_component(
    behavior: MakeBehavior, tmp_path: Path
) -> None:
    run = following(tmp_path, behavior)
    safety = SafetyPrx.uncheckedCast(run.world.communicator.stringToProxy("Safety"))
    run.advance(0.5)
    safety.emergencyStop("a test")
    run.advance(0.5)
    (error,) = run.errors
    assert "a callback of its code failed: CommandRefusedException" in error.message
    assert run.refusal is not None
    safety.resetEmergencyStop(True)
    run.advance(2.0)
    assert run.refusal is None
    assert not run.ended.is_set()


def test_a_callback_is_called_again_after_its_server_was_offline(
    behavior: MakeBehavior, tmp_path: Path
) -> None:
    run = following(tmp_path, behavior, STREAM.replace("Head.getPose", "Body.getJointState"))
    run.advance(0.5)
    with run.server_offline("Head"):
        run.advance(0.5)
    (error,) = run.errors
    assert "a callback of its code failed: ConnectionLostException" in error.message
    before = len(run.calls("Head.setPose"))
    run.advance(0.5)
    assert len(run.calls("Head.setPose")) > before + 10


def test_a_callback_commands_nothing_after_an_error_elsewhere(behavior: MakeBehavior, tmp_path: Path) -> None:
    follows = "heard = None\ndef hear(self, what):\n    self.Head.setPose(0.1, 0.0, 0.5)"
    code = f"if not self.heard:\n    {STREAM}\n1 / (self.clock.now() < 0.5)"
    root = sub(1, 0, state(1, "a", code, initial=True), functions=follows)
    made = load(compile_to(tmp_path, document(root, config=HEAD)))
    run = behavior(type(made), robot="fake", on_error="stop")
    run.advance(1.0)
    assert run.halted
    *commands, stop = [call.target for call in run.calls("Head")]
    assert set(commands) == {"Head.setPose"}
    assert stop == "Head.stop"


WRITTEN = {
    "a finalizer": "class Torn:\n    def __del__(self): 1 / 0\ndef fail(self): self.Torn()",
    "a generator that is left": (
        "def steps(self):\n    try:\n        yield\n    finally:\n        1 / 0\n"
        "def fail(self): next(self.steps())"
    ),
    "a thread without a name": "def fail(self): _thread.start_new_thread(lambda: 1 / 0, ())",
}
ONCE = "if not self.failed:\n    self.failed = True\n    self.fail()"


def first_error(run: Execution) -> ErrorReport:
    """Advance until there is an error, of threads that take their time; return the only one."""

    def is_told() -> bool:
        run.advance(0.1)
        return bool(run.errors)

    until(is_told)
    (error,) = run.errors
    return error


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("policy", OnError)
@pytest.mark.parametrize("what", WRITTEN)
def test_what_python_only_writes_is_an_error_of_the_component(
    what: str, policy: OnError, behavior: MakeBehavior, tmp_path: Path
) -> None:
    functions = f"failed = False\n{WRITTEN[what]}"
    root = sub(1, 0, state(1, "a", ONCE, initial=True), functions=functions)
    made = load(compile_to(tmp_path, document(root, config=HEAD, libraries=("_thread",))))
    run = behavior(type(made), robot="fake", on_error=policy)
    error = first_error(run)
    assert "ZeroDivisionError: division by zero" in error.message
    assert re.search(r"\(behavior.xml:\d+\)$", error.location)
    assert run.halted == bool(run.calls("Head.stop")) == (policy is OnError.STOP)


@pytest.fixture
def alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Forget the components of other tests: no other one is in the process."""
    monkeypatch.setattr(_own_threads, "_runs", WeakSet())


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.usefixtures("alone")
def test_what_python_wrote_the_time_before_is_no_error(behavior: MakeBehavior, tmp_path: Path) -> None:
    functions = f"failed = False\n{WRITTEN['a finalizer']}"
    made: Any = load(
        compile_to(tmp_path, document(sub(1, 0, state(1, "a", initial=True), functions=functions)))
    )
    behavior(type(made)).close()
    made.fail()
    run = behavior(type(made))
    run.advance(0.5)
    assert not run.errors


HELPER = """import threading

def fail(*_):
    1 / 0

def start():
    thread = threading.Thread(target=fail)
    thread.start()
    thread.join()
"""


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
@pytest.mark.usefixtures("alone")
@pytest.mark.parametrize(
    "code",
    ["helper.start()", "self.Head.getPose.subscribe(helper.fail)"],
    ids=["thread", "callback"],
)
def test_what_code_beside_the_document_raises_is_an_error_of_the_only_component(
    code: str, behavior: MakeBehavior, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "helper.py").write_text(HELPER, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "helper", raising=False)
    functions = f"failed = False\ndef fail(self):\n    self.kept = {code}"
    root = sub(1, 0, state(1, "a", ONCE, initial=True), functions=functions)
    made = load(compile_to(tmp_path, document(root, config=HEAD, libraries=("helper",))))
    run = behavior(type(made), robot="fake", on_error=OnError.STOP)
    error = first_error(run)
    assert error.message.endswith("ZeroDivisionError: division by zero")
    assert error.location == "helper.py:4"
    assert run.halted


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_an_exception_on_a_thread_after_the_end_is_no_error(tmp_path: Path) -> None:
    made = component(tmp_path, "lambda: self.go.wait() and 1 / 0")
    made.go = threading.Event()
    with Execution(made, stubs={"motors": {"stop": None}}) as run:
        run.advance(0.1)
        run.request_stop()
        made.go.set()
        made.threads[0].join(EVENT_LIMIT)
        run.advance(0.1)
        assert not run.errors


@pytest.mark.filterwarnings("error::pytest.PytestUnhandledThreadExceptionWarning")
def test_a_thread_that_the_end_of_the_component_ends_is_no_error(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made = component(tmp_path, "self.work")
    run = Runtime(made, WallClock())
    run.start()
    until(lambda: made.threads)
    run.stop()
    made.threads[0].join(EVENT_LIMIT)
    assert finished(made)
    assert not run.errors
    assert not capsys.readouterr().err
