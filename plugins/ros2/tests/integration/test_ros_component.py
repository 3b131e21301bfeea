"""A running component in the graph of ROS, with a second node as ROS' tools."""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from hfsm_runtime import Component, Parameter, State
from hfsm_runtime._runtime import Runtime
from hfsm_runtime.debugger.monitor import Monitor
from interfaces.hfsm import ComponentStatus
from tests.support.automata import after, automaton, on
from tests.support.documents import compile_to, document, load, state, sub, transition
from tests.support.limits import CALL_LIMIT, EVENT_LIMIT, RUN_LIMIT, START_LIMIT
from tests.support.places import ROOT
from tests.support.processes import ComponentProcess, free_endpoint
from tests.support.suite import Pair
from tests.support.waiting import until
from visualhfsm_ros2._monitor import RosMonitor
from zenoh_ice import Settings, WallClock
from zenoh_ros2 import Node, QoS

STATUS = "smach_msgs/msg/SmachContainerStatus"
STRUCTURE = "smach_msgs/msg/SmachContainerStructure"
TRIGGER = "std_srvs/srv/Trigger"


class Keeper(Component, events=["ball.right", "kick"]):
    """Waits for a kick, and then for a ball."""

    speed = Parameter(0.5, "m/s at most")
    side = Parameter("left")
    tries = Parameter(3)
    brave = Parameter(False)

    cycles = 0

    def automaton(self) -> Any:
        def work() -> None:
            self.cycles += 1
            if self.cycles == 1:
                self.log.warning("the keeper begins on the %s", self.side)

        child = automaton(7, "guard", [State("left"), State("right")], [on("ball.right", 1, 2, name="over")])
        return automaton(
            1,
            "keeper",
            [State("wait", code=work), State("guard", children=(child,))],
            [on("kick", 1, 2, name="kicked"), on("rest", 2, 1)],
            period=0.02,
        )


@dataclass(frozen=True)
class Scene:
    component: Keeper
    runtime: Runtime
    tool: Node

    def call(self, service: str) -> Any:
        client = self.tool.create_client(TRIGGER, f"/field/keeper/{service}")
        client.wait(EVENT_LIMIT)
        answer = client.call(timeout=CALL_LIMIT)
        client.close()
        return answer


@contextmanager
def played(pair: Pair, component: Any = None, *, starts: bool = True) -> Iterator[Scene]:
    endpoint = free_endpoint()
    component = component or Keeper()
    runtime = Runtime(component, WallClock())
    here = Settings(listen=(endpoint,), connect=())
    there = Settings(connect=(endpoint,))
    with (
        Node("keeper", namespace="/field", domain=9, settings=here) as node,
        Monitor(runtime, pair.server) as monitor,
        Node("tool", domain=9, settings=there) as tool,
        RosMonitor(monitor, node),
    ):
        if starts:
            runtime.start()
        try:
            yield Scene(component, runtime, tool)
        finally:
            runtime.stop()


@pytest.fixture
def scene(pair: Pair) -> Iterator[Scene]:
    with played(pair) as scene:
        yield scene


class Heard:
    """What a subscription of the tool has received."""

    def __init__(self, tool: Node, type_name: str, topic: str, *, late: bool = True) -> None:
        self.messages: list[Any] = []
        self.changed = threading.Condition()
        durability: Any = "transient_local" if late else "volatile"
        tool.create_subscription(type_name, topic, self.receive, QoS(durability=durability, depth=50))

    def receive(self, message: Any) -> None:
        with self.changed:
            self.messages.append(message)
            self.changed.notify_all()

    def wait_for(self, condition: Any, limit: float = EVENT_LIMIT) -> Any:
        """Return the first message for which a condition holds."""
        with self.changed:
            found = self.changed.wait_for(lambda: any(map(condition, self.messages)), limit)
            assert found, self.messages
            return next(filter(condition, self.messages))


def test_its_node_topics_and_services_are_in_the_graph(scene: Scene) -> None:
    graph = scene.tool.graph

    def offered() -> set[str]:
        services = graph.services().items()
        return {name.removeprefix("/field/keeper/") for name, (kind,) in services if kind == TRIGGER}

    own = {"pause", "resume", "step", "reload", "stop", "event/kick", "event/rest", "event/ball_right"}
    topics = {
        "/field/keeper/smach/container_status": [STATUS],
        "/field/keeper/smach/container_structure": [STRUCTURE],
        "/field/keeper/transitions": ["lifecycle_msgs/msg/TransitionEvent"],
        "/parameter_events": ["rcl_interfaces/msg/ParameterEvent"],
        "/rosout": ["rcl_interfaces/msg/Log"],
    }
    graph.wait(lambda: offered() >= own and graph.topics().keys() >= topics.keys(), EVENT_LIMIT)
    assert "/field/keeper" in graph.nodes()
    assert graph.topics() == topics
    assert offered() == own


def test_the_structure_is_there_for_those_who_join_late(scene: Scene) -> None:
    heard = Heard(scene.tool, STRUCTURE, "/field/keeper/smach/container_structure")
    root = heard.wait_for(lambda each: each.path == "/keeper")
    assert (root.children, root.internal_outcomes) == (["wait", "guard"], ["kicked", "rest"])
    assert (root.outcomes_from, root.outcomes_to) == (["wait", "guard"], ["guard", "wait"])
    child = heard.wait_for(lambda each: each.path == "/keeper/guard")
    assert (child.children, child.internal_outcomes) == (["left", "right"], ["over"])


def test_states_and_transitions_are_published_as_they_change(scene: Scene) -> None:
    status = Heard(scene.tool, STATUS, "/field/keeper/smach/container_status")
    transitions = Heard(
        scene.tool, "lifecycle_msgs/msg/TransitionEvent", "/field/keeper/transitions", late=False
    )
    first = status.wait_for(lambda each: each.path == "/keeper" and each.active_states)
    assert (first.active_states, first.initial_states, first.info) == (["wait"], ["wait"], "running")
    ghost = status.wait_for(lambda each: each.path == "/keeper/guard")
    assert (ghost.active_states, ghost.info) == ([], "running, inactive in left")
    graph = scene.tool.graph
    assert graph.wait(lambda: len(graph.entities("MP", "/field/keeper/transitions")) == 1, EVENT_LIMIT)
    until(lambda: scene.call("event/kick").success and transitions.messages)
    fired = transitions.messages[0]
    assert fired.transition.label == "kicked"
    assert (fired.start_state.label, fired.goal_state.label) == ("/keeper/wait", "/keeper/guard")
    assert (fired.start_state.id, fired.goal_state.id) == (1, 2)
    status.wait_for(lambda each: each.path == "/keeper" and each.active_states == ["guard"])
    status.wait_for(lambda each: each.path == "/keeper/guard" and each.active_states == ["left"])
    assert scene.call("event/ball_right").success
    status.wait_for(lambda each: each.path == "/keeper/guard" and each.active_states == ["right"])


def test_transitions_have_a_stamp_where_lyrical_is_sourced(
    pair: Pair, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_DISTRO", "lyrical")
    with played(pair) as scene:
        kind, topic = "lifecycle_msgs/msg/TransitionEvent", "/field/keeper/transitions"
        transitions = Heard(scene.tool, kind, topic, late=False)
        assert scene.tool.graph.wait(lambda: len(scene.tool.graph.entities("MP", topic)) == 1, EVENT_LIMIT)
        until(lambda: scene.call("event/kick").success and transitions.messages)
        assert transitions.messages[0].stamp.sec > 1_700_000_000


def test_no_state_is_active_before_the_start_as_events_are_lost_until_then(pair: Pair) -> None:
    with played(pair, starts=False) as scene:
        status = Heard(scene.tool, STATUS, "/field/keeper/smach/container_status")
        first = status.wait_for(lambda each: each.path == "/keeper")
        assert (first.active_states, first.info) == ([], "running, inactive in wait")
        scene.runtime.start()
        status.wait_for(lambda each: each.path == "/keeper" and each.active_states == ["wait"])


def test_services_pause_step_resume_and_stop(scene: Scene) -> None:
    refused = scene.call("step")
    assert (refused.success, refused.message) == (False, "the component is running: pause it first")
    paused = scene.call("pause")
    assert (paused.success, paused.message) == (True, "paused")
    assert scene.runtime.status is ComponentStatus.Paused
    until(lambda: not scene.runtime.in_cycle)
    before = scene.component.cycles
    assert scene.call("step").success
    until(lambda: scene.component.cycles == before + 1)
    resumed = scene.call("resume")
    assert (resumed.success, resumed.message) == (True, "running")
    until(lambda: scene.component.cycles > before + 1)
    undeclared = scene.call("event/rest")
    assert not undeclared.success
    assert "add <event><name>rest</name></event> to the <events>" in undeclared.message
    status = Heard(scene.tool, STATUS, "/field/keeper/smach/container_status")
    assert scene.call("stop").success
    assert scene.runtime.ended.wait(EVENT_LIMIT)
    status.wait_for(lambda each: each.path == "/keeper" and each.info.startswith("halted"))


def test_a_reload_shows_the_new_automata_events_and_parameters_or_says_why_not(
    pair: Pair, tmp_path: Path
) -> None:
    file = compile_to(tmp_path, goalie("kick", "float", "1.5"), "goalie")
    with played(pair, load(file)) as scene:
        heard = Heard(scene.tool, STRUCTURE, "/field/keeper/smach/container_structure")
        heard.wait_for(lambda each: each.internal_outcomes == ["kick"])
        compile_to(tmp_path, goalie("throw", "str", "'high'"), "goalie")
        answer = scene.call("reload")
        assert (answer.success, answer.message[:12]) == (True, "generation 1")
        heard.wait_for(lambda each: each.internal_outcomes == ["throw"])
        assert scene.call("event/throw").success
        until(lambda: "/field/keeper/event/kick" not in scene.tool.graph.services())
        get = scene.tool.create_client("rcl_interfaces/srv/GetParameters", "/field/keeper/get_parameters")
        until(lambda: get.call(names=["height"], timeout=CALL_LIMIT).values[0].string_value == "high")
        file.write_text("this is no Python", "utf-8")
        answer = scene.call("reload")
        assert not answer.success
        assert "goalie" in answer.message
        assert scene.runtime.status is ComponentStatus.Running


def goalie(event: str, kind: str, default: str) -> str:
    """Return a document that waits for an event, with the parameter `height`."""
    parameter = f"<name>height</name><type>{kind}</type><default>{default}</default>"
    waits = transition(1, 1, 2, event, type="event", name=event)
    return document(
        sub(1, 0, state(1, "wait", initial=True), state(2, "go"), waits),
        head=f"<parameters><parameter>{parameter}</parameter></parameters>",
        events=(event,),
    )


class Twins(Component, events=["go.on", "go_on"]):
    """Has states, automata and events whose names are the same, or none, for ROS."""

    def automaton(self) -> Any:
        below = [automaton(number, "pair", [State("in/out"), State("")]) for number in (5, 6)]
        states = [State("pair", children=tuple(below)), State("one"), State("one")]
        return automaton(1, "twins", states, [on("go.on", 1, 2, name="a"), on("go_on", 1, 3, name="b")])


def test_what_has_the_same_name_gets_its_id(pair: Pair, caplog: pytest.LogCaptureFixture) -> None:
    with played(pair, Twins()) as scene:
        heard = Heard(scene.tool, STRUCTURE, "/field/keeper/smach/container_structure")
        root = heard.wait_for(lambda each: each.path == "/twins")
        assert root.children == ["pair", "one:2", "one:3"]
        assert root.outcomes_to == ["one:2", "one:3"]
        for number in (5, 6):
            child = heard.wait_for(lambda each, path=f"/twins/pair:{number}": each.path == path)
            assert child.children == ["in_out", ":2"]
        assert scene.call("event/go_on").success
        until(lambda: scene.runtime.tree.root.current.id == 2)  # the first of both
    assert "ROS cannot send the event 'go_on'" in caplog.text


class Restless(Component):
    """Changes its state all the time."""

    def automaton(self) -> Any:
        there_and_back = [after(0.02, 1, 2), after(0.02, 2, 1)]
        return automaton(1, "restless", [State("a"), State("b")], there_and_back, period=0.02)


def test_viewers_that_keep_no_history_get_the_structure_even_while_states_change(pair: Pair) -> None:
    with played(pair, Restless()) as scene:
        heard = Heard(scene.tool, STRUCTURE, "/field/keeper/smach/container_structure", late=False)
        heard.wait_for(lambda each: each.children == ["a", "b"])


def test_parameters_are_read_and_set(scene: Scene) -> None:
    tool = scene.tool
    get = tool.create_client("rcl_interfaces/srv/GetParameters", "/field/keeper/get_parameters")
    put = tool.create_client("rcl_interfaces/srv/SetParameters", "/field/keeper/set_parameters")
    get.wait(EVENT_LIMIT)
    names = ["speed", "side", "tries", "brave"]
    values = get.call(names=names, timeout=CALL_LIMIT).values
    found = (values[0].double_value, values[1].string_value, values[2].integer_value, values[3].bool_value)
    assert found == (0.5, "left", 3, False)
    wanted = [
        {"name": "speed", "value": {"type": 3, "double_value": 0.25}},
        {"name": "side", "value": {"type": 4, "string_value": "right"}},
        {"name": "tries", "value": {"type": 4, "string_value": "many"}},
        {"name": "height", "value": {"type": 3, "double_value": 1.0}},
    ]
    results = put.call(parameters=wanted, timeout=CALL_LIMIT).results
    assert [each.successful for each in results] == [True, True, False, False]
    assert "tries" in results[2].reason
    assert "height" in results[3].reason
    assert (scene.component.speed, scene.component.side, scene.component.tries) == (0.25, "right", 3)
    scene.runtime.set_variable(0, "speed", 0.75)  # as the monitor does
    until(lambda: get.call(names=["speed"], timeout=CALL_LIMIT).values[0].double_value == 0.75)


def test_its_logs_are_on_rosout_until_it_ends(pair: Pair) -> None:
    with played(pair) as scene:
        heard = Heard(scene.tool, "rcl_interfaces/msg/Log", "/rosout")
        record = heard.wait_for(lambda each: "the keeper begins" in each.msg)
        assert (record.msg, record.level) == ("the keeper begins on the left", 30)
        assert record.file.endswith("test_ros_component.py")
        log = scene.component._hfsm_log
        assert len(log.handlers) == 1
    assert not log.handlers


def test_the_command_shows_any_component_that_is_asked_to(tmp_path: Path, endpoint: str) -> None:
    file = compile_to(tmp_path, goalie("kick", "float", "1.5"), "goalie")
    ros = free_endpoint()
    options = ("--ros-connect", ros, "--ros-domain", "9", "--ros-namespace", "/lab", "--height", "2.5")
    command = [sys.executable, str(file), "--connect", endpoint, "--clock", "wall", "--ros", *options]
    with (
        Node("tool", domain=9, settings=Settings(listen=(ros,), connect=())) as tool,
        ComponentProcess(command, {"PYTHONPATH": str(ROOT)}) as process,
    ):
        status = Heard(tool, STATUS, "/lab/goalie/smach/container_status")
        status.wait_for(lambda each: each.active_states == ["wait"], START_LIMIT)
        get = tool.create_client("rcl_interfaces/srv/GetParameters", "/lab/goalie/get_parameters")
        get.wait(START_LIMIT)
        assert get.call(names=["height"], timeout=CALL_LIMIT).values[0].double_value == 2.5
        kick = tool.create_client(TRIGGER, "/lab/goalie/event/kick")
        kick.wait(EVENT_LIMIT)
        assert kick.call(timeout=CALL_LIMIT).success
        status.wait_for(lambda each: each.active_states == ["go"])
        stop = tool.create_client(TRIGGER, "/lab/goalie/stop")
        stop.wait(EVENT_LIMIT)
        assert stop.call(timeout=CALL_LIMIT).success
        assert process.wait(RUN_LIMIT) == 0
        assert tool.graph.wait(lambda: "/lab/goalie" not in tool.graph.nodes(), EVENT_LIMIT)
