"""A generated component, where it has to be ended or followed as a process, with a robot server in that of the test."""

from __future__ import annotations

import re
import signal
import sys
from contextlib import AbstractContextManager, ExitStack, closing
from pathlib import Path
from typing import Any

import pytest

from hfsm_runtime import Component, Proxy
from hfsm_runtime._robot import connect
from hfsm_runtime.errors import ComponentError
from interfaces.hfsm import ComponentStatus, HfsmMonitorPrx
from interfaces.nao import PoseHeadPrx
from naoserver.fake import FakeRobot
from naoserver.serving import server
from tests.support.bodies import ARM
from tests.support.carriers import LOCAL, NETWORK, is_used, over_both
from tests.support.commands import run_file_here
from tests.support.component import MonitorStub
from tests.support.documents import compile_to, document, state, sub, transition
from tests.support.limited import HASTY
from tests.support.limits import END_LIMIT, RUN_LIMIT, SHORT_RUN, START_LIMIT
from tests.support.processes import ComponentProcess, module
from tests.support.robot_server import HASTE, ServedRobot, eventually, served
from tests.support.soak import cases
from zenoh_ice import ObjectNotExistException, ObjectPrx, initialize
from zenoh_ice.application.patience import Patience

HEAD = (
    "<iceinterface><nameinterface>head</nameinterface><nameproxy>Head</nameproxy>"
    "<interface>PoseHead</interface></iceinterface>"
)

SOON = ("--timeout", "10")
"""A servant is missed after a tenth of this."""


def serve(endpoint: str) -> AbstractContextManager[ServedRobot]:
    return served(FakeRobot(), realm="nao", endpoint=endpoint)


def turning(
    tmp_path: Path,
    code: str = "self.head.setSpeed(0.2, 0.0)\nprint('turning', flush=True)",
    config: str = HEAD,
) -> Path:
    return compile_to(
        tmp_path, document(sub(1, 0, state(1, "turn", code, initial=True)), config=config), "turner"
    )


def run(file: Path, endpoint: str, *arguments: str) -> tuple[int, str]:
    """Run a component that ends by itself in this process; return its exit code and output."""
    done = run_file_here(file, "--connect", endpoint, "--clock", "wall", *arguments)
    return done.returncode, done.stdout


def start(file: Path, endpoint: str, *arguments: str) -> ComponentProcess:
    command = [sys.executable, str(file), "--connect", endpoint, "--clock", "wall", *arguments]
    return ComponentProcess(command, {"PYTHONPATH": str(Path(__file__).resolve().parents[2])})


def test_without_a_server_it_says_where_it_looked_and_how_to_start_one(tmp_path: Path, endpoint: str) -> None:
    code, output = run(turning(tmp_path), endpoint, "--timeout", "0.3", "--server-wait", "0")
    assert code == 1
    assert output.count("\n") == 1
    assert endpoint in output
    assert "naoserver-sim" in output


@pytest.mark.parametrize("mode", ["peer", "client"])
def test_started_before_its_server_it_waits_for_it(tmp_path: Path, endpoint: str, mode: str) -> None:
    early = start(
        turning(tmp_path), endpoint, "--timeout", str(HASTE), "--seconds", str(SHORT_RUN), "--mode", mode
    )
    with early as component:
        component.wait_for(f"waiting for the server .*{endpoint}.*naoserver-sim")
        with serve(endpoint):
            component.wait_for("turning")
            assert component.wait(RUN_LIMIT) == 0
    assert component.output.count("waiting") == 1


def test_its_robot_may_come_later_than_the_router(tmp_path: Path, endpoint: str) -> None:
    with (
        initialize(mode="router", listen=[endpoint], connect=[]),
        start(turning(tmp_path), endpoint, "--timeout", str(HASTE), "--seconds", str(SHORT_RUN)) as component,
    ):
        component.wait_for("waiting for the server .*realm has no servants")
        fake = module("naoserver.fake", "--listen", "tcp/127.0.0.1:0", "--connect", endpoint)
        with ComponentProcess(fake):
            assert component.wait(RUN_LIMIT) == 0


def test_it_runs_for_the_time_given_and_stops_the_robot(tmp_path: Path, endpoint: str) -> None:
    with serve(endpoint):
        code, output = run(turning(tmp_path), endpoint, "--seconds", str(SHORT_RUN))
        assert code == 0
        assert "turning" in output
        with initialize(connect=[endpoint], clock="wall") as communicator:
            head = PoseHeadPrx.checkedCast(communicator.stringToProxy("Head"))
            assert head.getPose().pan > 0.0
            eventually(lambda: abs(head.getPose().panSpeed) < 0.05)


def test_the_time_given_passes_while_it_is_paused(tmp_path: Path, endpoint: str) -> None:
    with serve(endpoint):
        code, _ = run(turning(tmp_path), endpoint, "--seconds", str(SHORT_RUN), "--breakpoint", "1.1")
    assert code == 0


def test_a_servant_that_is_not_there_is_named(tmp_path: Path, endpoint: str) -> None:
    config = HEAD + HEAD.replace(">Head<", ">Tail<").replace(">head<", ">tail<")
    file = compile_to(tmp_path, document(sub(1, 0, state(1, "a", initial=True)), config=config), "turner")
    with serve(endpoint):
        code, output = run(file, endpoint, *SOON)
    assert code == 1
    assert (
        "the component cannot start: self.tail needs Tail (PoseHead), which this robot does not serve"
        in output
    )
    assert "Traceback" not in output


def test_what_a_robot_lacks_is_named_with_what_it_serves(tmp_path: Path, endpoint: str) -> None:
    config = HEAD + HEAD.replace(">Head<", ">Motors<").replace(">head<", ">wheels<")
    file = compile_to(tmp_path, document(sub(1, 0, state(1, "a", initial=True)), config=config), "turner")
    with served(FakeRobot(body=ARM), realm="nao", endpoint=endpoint):
        code, output = run(file, endpoint, *SOON)
    assert code == 1
    needs = "self.head needs Head (PoseHead), self.wheels needs Motors (PoseHead), which this robot does not serve"
    assert f"the component cannot start: {needs}; it serves " in output
    assert "CraneMotors" in output.partition("it serves ")[2], "it is named most like Motors"


def test_a_robot_that_starts_beside_another_program_is_waited_for() -> None:
    with ExitStack() as stack:
        robot = stack.enter_context(closing(FakeRobot()))
        communicator = stack.enter_context(initialize(realm="nao", connect=[], clock="wall", timeout=0.1))
        other, adapter = communicator.createObjectAdapter("Other"), communicator.createObjectAdapter("Robot")
        other.add(MonitorStub(), "Other")
        other.activate()
        refused: list[str] = []

        class LatePrx(PoseHeadPrx):
            """The robot starts when it was looked for without success."""

            @classmethod
            def checkedCast(cls, proxy: ObjectPrx) -> Any:
                try:
                    return PoseHeadPrx.checkedCast(proxy)
                except ObjectNotExistException as error:
                    refused.append(str(error))
                    if len(refused) == 1:
                        stack.enter_context(server.serve(robot, adapter))
                        adapter.activate()
                    raise

        class Turner(Component):
            head = Proxy("Head", LatePrx)

        turner = Turner()
        connect(turner, communicator, Patience(START_LIMIT))
        turner.head.ice_invocationTimeout(1000.0 * START_LIMIT).setSpeed(0.2, 0.0)
    assert len(refused) == 1


def test_a_document_of_a_foreign_name_can_be_watched(tmp_path: Path, endpoint: str) -> None:
    code = "print('sees', flush=True)"
    text = document(sub(1, 0, state(1, "a", code, initial=True)))
    with (
        serve(endpoint),
        start(compile_to(tmp_path, text, "se\N{LATIN SMALL LETTER N WITH TILDE}al"), endpoint) as component,
    ):
        component.wait_for("sees")
        with initialize(connect=[endpoint], clock="wall") as communicator:
            monitor = HfsmMonitorPrx.checkedCast(communicator.stringToProxy("Hfsm.senal"))
            assert monitor.getStructure().name == "senal"


def test_a_realm_without_servants_is_reported_once(endpoint: str) -> None:
    class Turner(Component):
        head = Proxy("Head", PoseHeadPrx)
        other = Proxy("Head", PoseHeadPrx)

    with (
        serve(endpoint),
        initialize(realm="elsewhere", connect=[endpoint], clock="wall", limits=HASTY) as communicator,
        pytest.raises(ComponentError) as refused,
    ):
        connect(Turner(), communicator)
    assert str(refused.value).count("no servants: no robot is here") == 1


@pytest.mark.parametrize(
    ("carrier", "number", "code"),
    cases(
        [(LOCAL, signal.SIGINT, 130), (NETWORK, signal.SIGTERM, 143)],
        [pytest.param(LOCAL, signal.SIGTERM, 143), pytest.param(NETWORK, signal.SIGINT, 130)],
    ),
)
def test_a_signal_stops_the_robot_and_ends_it(
    *,
    tmp_path: Path,
    by_environment: None,
    carrier: str,
    endpoint: str,
    number: signal.Signals,
    code: int,
) -> None:
    with serve(endpoint), start(turning(tmp_path), endpoint) as component:
        component.wait_for("turning")
        assert is_used(carrier, component.process.pid)
        component.process.send_signal(number)
        assert component.wait(END_LIMIT) == code
        assert "Traceback" not in component.output
        with initialize(connect=[endpoint], clock="wall") as communicator:
            head = PoseHeadPrx.checkedCast(communicator.stringToProxy("Head"))
            eventually(lambda: abs(head.getPose().panSpeed) < 0.05)


def test_a_signal_ends_variables_that_wait(tmp_path: Path, endpoint: str) -> None:
    waits = "import threading\nprint('waiting', flush=True)\nthreading.Event().wait()"
    file = compile_to(tmp_path, document(sub(1, 0, state(1, "a", initial=True), variables=waits)))
    with start(file, endpoint) as component:
        component.wait_for("waiting")
        component.process.send_signal(signal.SIGTERM)
        assert component.wait(END_LIMIT) == 143
        assert "Traceback" not in component.output


def test_an_error_in_user_code_ends_it_with_the_documents_line(tmp_path: Path, endpoint: str) -> None:
    file = turning(tmp_path, "self.head.setSpeed(0.2, 0.0)\nself.nothing()")
    with serve(endpoint):
        code, output = run(file, endpoint)
    assert code == 1
    assert "AttributeError" in output
    assert "(turner.xml:4)" in output


def test_stay_halted_keeps_the_monitor_after_an_error(tmp_path: Path, endpoint: str) -> None:
    file = turning(tmp_path, "self.head.setSpeed(0.2, 0.0)\n1 / 0")
    with serve(endpoint), start(file, endpoint, "--stay-halted") as component:
        component.wait_for("halted; Ctrl-C ends the component")
        with initialize(connect=[endpoint], clock="wall") as communicator:
            proxy = HfsmMonitorPrx.checkedCast(communicator.stringToProxy("Hfsm.turner"))
            snapshot = proxy.getSnapshot()
        assert snapshot.status is ComponentStatus.Halted
        assert snapshot.errors[0].message == "ZeroDivisionError: division by zero"
        component.process.send_signal(signal.SIGINT)
        assert component.wait(END_LIMIT) == 130


def test_threads_of_code_that_halted_command_nothing_any_more(tmp_path: Path, endpoint: str) -> None:
    functions = """def work(self):
    try:
        while True:
            self.head.setSpeed(0.2, 0.0)
            time.sleep(0.01)
    except BaseException as error:
        self.head.stop()
        print("the thread ended:", error, flush=True)"""
    code = "threading.Thread(target=self.work, daemon=True).start()\nself.sleep(0.1)\n1 / 0"
    root = sub(1, 0, state(1, "turn", code, initial=True), functions=functions)
    file = compile_to(tmp_path, document(root, libraries=("threading", "time"), config=HEAD), "turner")
    with serve(endpoint), start(file, endpoint, "--stay-halted") as component:
        component.wait_for("the thread ended: Head.setSpeed: the component has ended")
        component.process.send_signal(signal.SIGINT)
        assert component.wait(END_LIMIT) == 130


def test_on_error_continue_goes_on(tmp_path: Path, endpoint: str) -> None:
    file = turning(tmp_path, "print('again', flush=True)\n1 / 0")
    with serve(endpoint), start(file, endpoint, "--on-error", "continue") as component:
        eventually(lambda: component.output.count("again") > 2)
        component.process.send_signal(signal.SIGINT)
        assert component.wait() == 130
        assert component.output.count("Traceback") == 1
        frames = re.findall(r'^  File "(.*?)"', component.output, re.MULTILINE)
        assert frames == [str(file)], "of the code that runs it nothing is shown"


@over_both
def test_a_lost_server_is_reported_once_and_it_goes_on_when_the_server_is_back(
    tmp_path: Path, by_environment: None, endpoint: str
) -> None:
    """A server that is killed is lost in `tests/faults/test_commands.py`."""
    with ExitStack() as first:
        first.enter_context(serve(endpoint))
        with start(turning(tmp_path), endpoint) as component:
            component.wait_for("turning")
            first.close()
            component.wait_for("waiting for the server")
            with serve(endpoint):
                component.wait_for("the server is back")
                count = component.output.count("turning")
                eventually(lambda: component.output.count("turning") > count)
                # While the second server is there: its end is another loss.
                assert component.output.count("waiting for the server") == 1


def test_a_component_without_proxies_needs_no_server(tmp_path: Path, endpoint: str) -> None:
    text = document(
        sub(
            1,
            0,
            state(1, "a", initial=True),
            state(2, "b", "import sys\nsys.exit()"),
            transition(1, 1, 2, "100", type="time"),
        )
    )
    assert run(compile_to(tmp_path, text, "alone"), endpoint)[0] == 0


def test_it_begins_in_the_given_state(tmp_path: Path, endpoint: str) -> None:
    below = sub(
        2,
        1,
        state(1, "a", "print('a', flush=True)", initial=True),
        state(2, "b", "import sys\nprint('in b', flush=True)\nsys.exit()"),
    )
    root = sub(1, 0, state(1, "here", "print('here', flush=True)", initial=True), state(2, "there", child=2))
    file = compile_to(tmp_path, document(root, below), "jumper")
    code, output = run(file, endpoint, "--begin-at", "2.2")
    assert code == 0
    assert output.splitlines()[0] == "in b"
    code, output = run(file, endpoint, "--begin-at", "2.7")
    assert code == 1
    assert "automaton 2 has no state 7" in output


def test_it_pauses_at_a_breakpoint_that_was_set_before_its_first_cycle(tmp_path: Path, endpoint: str) -> None:
    text = document(sub(1, 0, state(1, "here", "count += 1", initial=True), variables="count = 7"))
    file = compile_to(tmp_path, text, "waiter")
    with initialize(connect=[], listen=[endpoint], clock="wall") as communicator:
        with start(file, endpoint, "--breakpoint", "1.1:count == 7"):
            monitor = HfsmMonitorPrx.uncheckedCast(communicator.stringToProxy("Hfsm.waiter"))
            for sample in monitor.getSnapshot.samples(timeout=START_LIMIT):
                if sample.value.stoppedAt:
                    break
        assert sample.value.status is ComponentStatus.Paused
        assert sample.value.automata[0].variables == {"count": "7"}
    for wrong, reported in (
        ("1.9", "has no state 9"),
        ("1.1:x +", "the condition"),
        ("1", "AUTOMATON.STATE"),
    ):
        code, output = run(file, endpoint, "--breakpoint", wrong)
        assert code in (1, 2)
        assert reported in output


def test_help_shows_the_description_and_examples(tmp_path: Path, endpoint: str) -> None:
    code, output = run(turning(tmp_path), endpoint, "--help")
    assert code == 0
    assert "The component turner." in output
    assert "--on-error" in output
    assert "python turner.py --seconds 60" in output
