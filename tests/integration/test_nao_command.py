"""The command `nao` with a robot, and with an interface without generated code."""

from __future__ import annotations

import json
import logging
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec
import pytest
import typer
from PIL import Image
from typer.main import get_command

from nao_tools._command import app
from nao_tools._completion import complete_call, complete_camera, complete_servant, complete_stream
from nao_tools._doctor.network import check_network
from nao_tools.findings import Level
from naoserver.fake import FakeRobot
from tests.support.carriers import NETWORK, calls_over_network, over_both
from tests.support.gripper import GripperI
from tests.support.limits import END_LIMIT, RUN_LIMIT
from tests.support.nao_command import at, nao
from tests.support.processes import ComponentProcess, free_endpoint, module
from tests.support.robot_server import ServedRobot, served
from tests.support.slice_compiler import imported
from tests.support.stranger import session_of
from tests.support.waiting import until
from zenoh_ice import Current, Object, initialize, load_settings
from zenoh_ice.data.status import version_of


@pytest.fixture(scope="module")
def robot() -> Iterator[ServedRobot]:
    with served(FakeRobot()) as server, at(server.endpoint, server.realm):
        yield server


TOOLS = """
module tools {
  enum Mode { Add, Divide };
  exception Failure { string what; };
  exception ByZero extends Failure { double dividend; };
  class Node { int value; Node next; };
  sequence<byte> Bytes;
  dictionary<Mode, int> Counts;
  interface Calculator {
    double add(double a, double b);
    double divide(double a, double b, out double remainder) throws Failure;
    Bytes echo(Bytes data);
    int count();
    int total(Node head);
    Counts swap(Counts counts, Mode first);
    optional(1) int maybe(optional(2) int x);
    Calculator* itself();
    void fail(string text);
  };
};
"""


def make_calculator(api: Any) -> Any:
    class CalculatorI(api.Calculator):  # type: ignore[misc]
        counted = 0

        def add(self, a, b, current):
            return a + b

        def divide(self, a, b, current):
            if b == 0:
                raise api.ByZero("the divisor is 0", a)
            return a // b, a % b

        def echo(self, data, current):
            return data

        def count(self, current):
            self.counted += 1
            return self.counted

        def total(self, head, current):
            return head.value + (self.total(head.next, current) if head.next else 0)

        def swap(self, counts, first, current):
            return {api.Mode(1 - mode): count for mode, count in counts.items()} | {first: 0}

        def maybe(self, x, current):
            return x

        def itself(self, current):
            return api.CalculatorPrx.uncheckedCast(current.communicator.stringToProxy(current.identity))

        def fail(self, text, current):
            raise RuntimeError(text)

    return CalculatorI()


@pytest.fixture(scope="module")
def tools(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    with imported(tmp_path_factory.mktemp("tools"), "tools_of_test", {"tools.idl": TOOLS}) as package:
        yield __import__(f"{package.__name__}.tools", fromlist=["Calculator"])


@contextmanager
def serving(api: Any, **settings: Any) -> Iterator[Any]:
    """Serve two calculators, `tools.Calculator` and `tools.Second`, in another session than the robot's."""
    with initialize(clock="wall", **settings) as communicator:
        adapter = communicator.createObjectAdapter("Tools")
        servant = make_calculator(api)
        adapter.add(servant, "tools.Calculator")
        adapter.add(make_calculator(api), "tools.Second")
        adapter.activate()
        yield servant


@pytest.fixture
def calculator(robot: ServedRobot, tools: Any) -> Iterator[Any]:
    with serving(tools, realm=robot.realm, connect=[robot.endpoint]) as servant:
        yield servant


def test_servants_are_listed_with_interface_and_server(robot: ServedRobot) -> None:
    listed = nao("list", "Head")
    assert listed.code == 0
    head, row = listed.out.splitlines()
    assert head.split() == ["SERVANT", "INTERFACE", "SERVED", "BY", "FOR"]
    assert row.split()[:2] == ["Head", "nao::PoseHead"]
    assert str(os.getpid()) in row


def test_a_servants_own_interface_is_reported_not_one_that_it_extends(robot: ServedRobot) -> None:
    (camera,) = json.loads(nao("list", "Camera", "--json").out)[:1]
    assert camera["interface"] == "::jderobot::Camera"
    assert set(camera["interfaces"]) == {"::jderobot::Camera", "::jderobot::ImageProvider"}
    assert camera["server"]["pid"] == os.getpid()


def test_patterns_choose_servants(robot: ServedRobot) -> None:
    def names(pattern: str) -> set[str]:
        return {each["servant"] for each in json.loads(nao("list", pattern, "--json").out)}

    assert names("left*motors") == set()
    assert "LeftHipMotors" in names("Left*Motors")
    assert names("posehead") == {"Head"}
    assert nao("list", "nothing").err.startswith("nao: error: none of ")


def test_a_command_lasts_until_the_robot_is_where_it_was_sent(robot: ServedRobot) -> None:
    assert nao("call", "Head.setPose", "0.4", "0.1", "0.3").code == 0
    assert robot.robot.read().commands[:2] == pytest.approx((0.4, 0.1))
    assert nao("call", "Head.setSpeed", "-0.2", "0.0").code == 0
    assert robot.assembly.body.velocity("HeadYaw") == 0.0, "its time has run out"


@pytest.mark.parametrize(
    ("words", "end", "says"),
    [
        (
            ("Walk.walkTo", "5", "0", "0"),
            lambda of: of.walk.drive({"turn": 0.2}, "berta"),
            "another command of the walk ended it, of berta",
        ),
        (("Walk.walkTo", "5", "0", "0"), lambda of: of.walk.stop(), "it ended early: the walk was stopped"),
        (
            ("Postures.goToPosture", "Crouch", "0.2"),
            lambda of: of.postures.go("StandInit", 1.0, "berta"),
            "it ended early: another one began",
        ),
        (
            ("Motions.play", "wave", "1"),
            lambda of: of.postures.go("StandInit", 1.0, "berta"),
            "it ended early: the posture StandInit began",
        ),
    ],
    ids=["walk", "stop", "posture", "motion"],
)
def test_a_command_that_something_else_ends_is_an_error(
    robot: ServedRobot, words: tuple[str, ...], end: Callable[[Any], None], says: str
) -> None:
    walk = robot.assembly.walk
    assert walk is not None

    def disturb() -> None:
        until(lambda: robot.assembly.player.busy or walk.commanded().forward > 0.0)
        end(robot.assembly)

    with ThreadPoolExecutor(1) as disturber:
        disturbance = disturber.submit(disturb)
        outcome = nao("call", *words)
        disturbance.result(END_LIMIT)
    assert (outcome.code, says in outcome.err) == (1, True), outcome.err
    until(lambda: not robot.assembly.player.busy)


def test_names_with_dots_are_listed_and_called(calculator: Any) -> None:
    assert "tools.Second" in nao("list", "tools").out
    calculator.counted = 10
    assert nao("call", "tools.Calculator.count").out == "11\n"
    assert nao("call", "tools.Second.count").out == "1\n"


@pytest.mark.parametrize(
    ("operation", "words", "result"),
    [
        ("add", ["1", "-2.5"], -1.5),
        ("add", ["b=2", "a=1"], 3.0),
        ("add", ['{"a": 1, "b": 2}'], 3.0),
        ("divide", ["7", "2"], {"returnValue": 3.0, "remainder": 1.0}),
        ("echo", ["[1, 2, 255]"], "AQL/"),
        ("echo", ["AQL/"], "AQL/"),
        ("total", ['{"value": 2, "next": {"value": 3, "next": null}}'], 5),
        ("swap", ['{"Add": 1}', "Add"], {"Divide": 1, "Add": 0}),
        ("maybe", [], None),
        ("maybe", ["3"], 3),
        ("itself", [], "tools.Calculator"),
        ("ice_ping", [], None),
        ("ice_id", [], "::tools::Calculator"),
        ("ice_isA", ["::tools::Calculator"], True),
    ],
)
def test_any_servant_can_be_called(calculator: Any, operation: str, words: list[str], result: object) -> None:
    outcome = nao("call", f"tools.Calculator.{operation}", *words, "--json")
    assert (outcome.err, json.loads(outcome.out or "null")) == ("", result)


def test_what_a_servant_raises_is_one_line(calculator: Any) -> None:
    declared = nao("call", "tools.Calculator.divide", "1", "0")
    assert declared.code == 1
    assert declared.err == "nao: error: tools::Failure: the divisor is 0\n"
    undeclared = nao("call", "tools.Calculator.fail", "anything")
    assert "RuntimeError: anything" in undeclared.err


def test_arguments_are_read_from_files_and_standard_input(calculator: Any, tmp_path: Path) -> None:
    (tmp_path / "data").write_bytes(bytes(range(256)))
    from_file = nao("call", "tools.Calculator.echo", f"@{tmp_path / 'data'}", "--json")
    from_input = nao("call", "tools.Calculator.echo", "@-", "--json", stdin=bytes(range(256)))
    assert from_file.out == from_input.out != ""
    assert "cannot read" in nao("call", "tools.Calculator.echo", "@/no/such/file").err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["Head.getpose"], "did you mean Head.getPose?"),
        (["Head"], "name an operation of Head, such as Head."),
        (["Head.setPose", "1"], "setPose needs tilt, fraction as well: HeadPose setPose(double pan, "),
        (["Head.setPose", "1", "2", "3", "4"], "'4' is one value too many: "),
        (["Head.setPose", "1", "2", "pan=3"], "pan is given twice"),
        (["Head.setPose", "1", "left", "3"], "tilt: 'left' is not double as JSON"),
        (["Head.setPose", "1", "true", "3"], "tilt: true is not double"),
        (["Head.setPose", '{"pan": 1, "tlit": 2}'], "setPose has no parameter 'tlit'"),
        (["LeftHipMotors.setPose3DMotorsData", '{"titl": 1}'], "did you mean tilt?"),
        (["Camera.getImageData", "GIF"], "jderobot::ConfigurationNotExistException: Camera has no format"),
    ],
)
def test_what_is_wrong_with_a_call_is_reported(robot: ServedRobot, words: list[str], message: str) -> None:
    outcome = nao("call", *words)
    assert message in outcome.err
    assert (outcome.code, outcome.out) == (1, "")


def test_a_servant_is_found_by_all_of_its_name(calculator: Any, robot: ServedRobot) -> None:
    name = f"tools.Calculator@{robot.realm}"
    assert nao("call", f"{name}.add", "1", "2", "--realm", "other").out == "3.0\n"
    # A tenth of the timeout is waited for a servant `tools`, whose operation it could be.
    assert "  int count()" in nao("describe", "tools.Second", "--timeout", "5").out


@pytest.mark.parametrize("words", [("describe", "Liar"), ("call", "Liar.f"), ("watch", "Liar")])
def test_a_servant_that_describes_nonsense_is_reported(robot: ServedRobot, words: tuple[str, ...]) -> None:
    class Liar(Object):
        def ice_describe(self, current: Current) -> str:
            return "{"

    with initialize(clock="wall", realm=robot.realm, connect=[robot.endpoint]) as communicator:
        adapter = communicator.createObjectAdapter("Liars")
        adapter.add(Liar(), "Liar")
        adapter.activate()
        outcome = nao(*words)
    assert "malformed schema of an interface: " in outcome.err
    assert (outcome.code, outcome.out) == (1, "")


def test_a_servant_without_a_schema_says_what_is_missing(robot: ServedRobot) -> None:
    with initialize(clock="wall", realm=robot.realm, connect=[robot.endpoint]) as communicator:
        adapter = communicator.createObjectAdapter("Grippers")
        adapter.add(GripperI(), "Gripper")
        adapter.activate()
        message = nao("describe", "Gripper").err
    assert "has no readable schema.json: generate it with codegen" in message


def test_an_unknown_option_is_no_argument(robot: ServedRobot) -> None:
    assert nao("call", "Head.getPose", "--jsn").code == 2


def test_description_reports_operations_and_types(robot: ServedRobot) -> None:
    text = nao("describe", "Body").out
    assert "dictionary<string, double> setJointPositions(dictionary<string, double> targets, " in text
    assert "JointState getJointState()  [stream, idempotent]" in text
    assert "struct JointLimits: string name, double lower" in text
    assert "did you mean Head.getPose?" in nao("describe", "Head.getPos").err
    (operation,) = json.loads(nao("describe", "Head.getPose", "--json").out)["operations"]
    assert (operation["streamed"], operation["results"]) == (
        True,
        [{"name": "returnValue", "type": "::nao::HeadPose"}],
    )


def test_samples_are_watched_as_json(robot: ServedRobot) -> None:
    lines = [json.loads(line) for line in nao("watch", "Head", "--count", "3", "--json").out.splitlines()]
    assert [set(line["value"]) >= {"pan", "tilt"} for line in lines] == [True] * 3
    assert lines[0]["sequence"] < lines[1]["sequence"] < lines[2]["sequence"]


def test_figures_are_watched_as_lines(robot: ServedRobot) -> None:
    head, *lines = nao("watch", "Body.getJointState", "--count", "5").out.splitlines()
    assert head.startswith("Body.getJointState of ::nao::Joints in realm ")
    assert lines[-1].startswith("rate ")
    assert lines[-1].endswith("  lost 0")


def test_what_is_no_stream_cannot_be_watched(robot: ServedRobot) -> None:
    assert "LeftHipMotors has no streams, it can only be called" in nao("watch", "LeftHipMotors").err
    assert (
        "Head.stop is not a stream, it can only be called; there is Head.getPose"
        in nao("watch", "Head.stop").err
    )


def test_images_are_saved_by_the_ending_of_the_file(robot: ServedRobot, tmp_path: Path) -> None:
    for name, kind in (("a.png", "PNG"), ("a.jpg", "JPEG"), ("a.ppm", "PPM")):
        saved = json.loads(nao("save-image", "Camera", str(tmp_path / name), "--json").out)
        with Image.open(tmp_path / name) as image:
            assert (image.format, image.size) == (kind, (saved["width"], saved["height"]))
            image.load()
    assert "unknown image format" in nao("save-image", "Camera", "a.gif").err
    assert "provides no images" in nao("save-image", "Head").err
    assert "cannot write" in nao("save-image", "Camera", "/no/such/folder/a.png").err


@over_both
def test_status_reports_robot_and_processes(
    robot: ServedRobot, carrier: str, by_environment: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        robot.served_by.pool, "place", robot.served_by.pool.place
    )  # until the end of the test
    over_network = calls_over_network(robot.served_by)
    nao("call", "Speech.ice_ping")
    message = json.loads(nao("status", "--json").out)
    assert message["robot"]["Clock"]["simulated"] in {True, False}
    assert message["robot"]["Description"] == {"name": "H25", "title": "Nao H25"}
    (process,) = message["processes"]
    assert process["pid"] == os.getpid()
    speech = next(each for name, each in process["servants"].items() if name.startswith("Speech"))
    assert speech["calls"] >= 1
    assert bool(over_network) is (carrier == NETWORK)
    text = nao("status", "--all").out
    assert "upright" in text
    assert "Nao H25" in text
    assert "Speech" in text


def test_a_server_that_describes_itself_otherwise_has_another_version(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("zenoh_ice.objects._servant.Object.ice_describe", lambda *_: "[]")
    status = msgspec.msgpack.encode({"version": "0.1.0"})
    monkeypatch.setattr("zenoh_ice.objects._communicator.encode_status", lambda *_, **__: status)
    own = version_of("visualhfsm")
    expected = (
        f"Clock describes itself otherwise: its server has VisualHFSM 0.1.0, this is {own}: install the same"
    )
    with served(FakeRobot()) as old, at(old.endpoint, old.realm):
        assert expected in " ".join(nao("call", "Clock.getTime").err.split())
        assert expected in json.loads(nao("status", "--json").out)["robot"]["Clock"]["error"]
        found = list(check_network(load_settings()))
    (clock,) = (each for each in found if "clock" in each.text)
    assert expected in clock.text
    assert clock.fix == "install the same version on both sides"


def test_doctor_finds_who_serves_a_name_twice(tools: Any) -> None:
    ends = [free_endpoint(), free_endpoint()]
    with (
        serving(tools, realm="twice", listen=ends[:1], connect=[]),
        serving(tools, realm="twice", listen=ends[1:], connect=[]),
    ):
        found = list(check_network(load_settings(flags={"realm": "twice", "connect": ends, "clock": "wall"})))
    (failure,) = (each.text for each in found if each.level == "FAIL")
    assert " serve the same 2 names, " in failure
    assert failure.endswith("tools.Calculator, tools.Second")


@pytest.mark.parametrize(
    ("there", "here", "way", "notes"),
    [
        (True, True, "through its local socket", []),
        (True, False, "over the network", ["is not reached through its local socket"]),
        (False, True, "over the network", ["has no local socket"]),
    ],
)
def test_doctor_finds_which_way_calls_to_a_process_of_this_machine_go(
    tools: Any, there: bool, here: bool, way: str, notes: list[str]
) -> None:
    end = free_endpoint()
    with serving(tools, realm="alone", listen=[end], connect=[], local_sockets=there):
        flags = {"realm": "alone", "connect": [end], "clock": "wall", "local_sockets": here}
        found = list(check_network(load_settings(flags=flags)))
    assert any(f" {os.getpid()} answers {way} within " in each.text for each in found)
    rest = "calls and images of this machine go over the network"
    noted = [each.text for each in found if each.level == Level.NOTE and "local socket" in each.text]
    assert [text.partition(f" {os.getpid()} ")[2] for text in noted] == [f"{note}: {rest}" for note in notes]


def test_a_realm_without_servants_names_those_that_have_some(robot: ServedRobot) -> None:
    assert nao("list", "--realm", "empty").err.endswith(f"has no servants; there is --realm {robot.realm}\n")


def test_a_realm_of_an_older_version_is_called_so() -> None:
    end = free_endpoint()
    with initialize(clock="wall", listen=[end], connect=[]) as communicator, at(end, "theirs"):
        token = "@servant/theirs/Head/::nao::PoseHead/c0ffee"
        with session_of(communicator).liveliness().declare_token(token):
            text = "realm 'theirs' has servants of VisualHFSM in another version, this is"
            assert text in nao("list").err
            (failure,) = (each for each in check_network(load_settings()) if each.level == Level.FAILURE)
    assert text in failure.text
    assert failure.fix == "then start both again"


def test_nobody_at_the_endpoint_is_reported_with_what_to_do() -> None:
    outcome = nao("list", "--connect", "tcp/127.0.0.1:9")
    assert (outcome.code, "nothing answers at tcp/127.0.0.1:9" in outcome.err) == (1, True)


# As separate processes.


def nao_process(*words: str) -> list[str]:
    return module("nao_tools", *words)


def test_names_are_completed_from_what_is_alive(robot: ServedRobot, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(logging, "disable", lambda: None)  # of this process
    context = typer.Context(get_command(app))
    assert complete_call(context, "Head.set") == ["Head.setPose", "Head.setSpeed"]
    assert complete_call(context, "Hea") == ["Head.", "Health."]
    assert complete_servant(context, "Hea") == ["Head", "Health"]
    assert "Body.getJointState" in complete_stream(context, "B")
    assert complete_camera(context, "Cam")[:2] == ["Camera", "CameraBottom"]


def test_bash_completes_also_after_an_endpoint(robot: ServedRobot) -> None:
    # Of `nao call --connect tcp/127.0.0.1:7447 Head.set`; bash takes the endpoint for three words.
    words = ["nao", "call", "--connect", *re.split("(:)", robot.endpoint), "Head.set"]
    code = "import sys; sys.argv[0] = 'nao'; from nao_tools.__main__ import main; main()"
    line = {"COMP_WORDS": "\n".join(words), "COMP_CWORD": str(len(words) - 1)}
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "VISUALHFSM_CONNECT": "", **line, "_NAO_COMPLETE": "complete_bash"},
        capture_output=True,
        text=True,
        timeout=RUN_LIMIT,
        check=False,
    )
    assert (done.stdout.split(), done.stderr) == (["Head.setPose", "Head.setSpeed"], "")


def test_watching_ends_quietly_at_ctrl_c_and_when_nobody_reads(robot: ServedRobot) -> None:
    with ComponentProcess(nao_process("watch", "Head", "--json")) as watching:
        watching.wait_for('"sequence"')
        watching.process.send_signal(signal.SIGINT)
        assert watching.process.wait(END_LIMIT) == 130
        assert "Traceback" not in watching.output
    with subprocess.Popen(
        nao_process("watch", "Head", "--json"), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.readline()
        process.stdout.close()
        assert process.wait(END_LIMIT) != 0
        assert process.stderr.read() == ""
