"""Behaviors with interfaces of ROS, in virtual time on the ROS of a test."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from hfsm_runtime import Component, Ros
from hfsm_runtime.errors import CycleCutError
from hfsm_runtime.virtual import TaskClock, VirtualWorld
from tests.support.documents import document, state, sub, transition
from tests.support.places import ROOT
from visualhfsm.testing import Behavior, BehaviorFailed, MakeBehavior, UnknownName
from zenoh_ros2 import CallError, CallTimeoutError, GoalRejectedError, MessageError, Status

EXAMPLE = ROOT / "examples" / "turtlebot" / "bump_and_go.xml"
COUNT = "int64 number\nmy_msgs/Where where\n---\nint64 reached\n---\nint64 now\n"


def ros(kind: str, name: str, target: str, type: str, more: str = "") -> str:
    return (
        f'<rosinterface kind="{kind}"><name>{name}</name><target>{target}</target><type>{type}</type>{more}'
        "</rosinterface>"
    )


def made(behavior: MakeBehavior, directory: Path, *interfaces: str, **options: str) -> Behavior:
    """Return a behavior of one state, which tests let do something."""
    head = f"<ros>{''.join(interfaces)}</ros>"
    code = options.pop("code", "")
    path = directory / "one.xml"
    path.write_text(document(sub(1, 0, state(1, "one", code, initial=True), **options), head=head))
    return behavior(path)


def later(run: Behavior, seconds: float, do: Callable[[], None]) -> None:
    """Do something while code of the behavior waits."""
    assert isinstance(run.clock, TaskClock)
    run.clock.call_at(run.clock.now() + seconds, do)


def test_a_turtlebot_drives_backs_off_turns_and_drives_again(behavior: MakeBehavior) -> None:
    run = behavior(EXAMPLE, parameters={"speed": 0.25})
    scan, cmd_vel = run.ros.topic("/scan"), run.ros.topic("/cmd_vel")

    def see(distance: float) -> None:
        scan.publish(ranges=[distance] * 9, angle_min=-0.4, angle_increment=0.1, range_min=0.1, range_max=5.0)

    run.advance(0.5)
    assert run.active == "wait"
    see(2.0)
    run.run_until("go", limit=0.2)
    run.advance(0.1)
    assert cmd_vel.messages[-1].linear.x == 0.25
    see(0.3)
    run.run_until("turn", limit=1.5)
    assert run.calls("/cmd_vel")[-1].linear.x == 0.0
    assert cmd_vel.messages[-1].angular.z == 0.8
    assert min(each.linear.x for each in cmd_vel.messages) == -0.25
    run.run_until("wait", limit=2.0)
    see(2.0)
    run.run_until("go", limit=0.2)


def test_old_scans_stop_it(behavior: MakeBehavior) -> None:
    run = behavior(EXAMPLE)
    run.ros.topic("/scan").publish(ranges=[2.0], range_max=5.0)
    run.run_until("go", limit=0.3)
    run.run_until("wait", limit=1.2)
    run.advance(0.1)
    assert run.ros.topic("/cmd_vel").messages[-1].linear.x == 0.0


def test_an_error_stops_what_the_component_drove(behavior: MakeBehavior, tmp_path: Path) -> None:
    twist = "geometry_msgs/msg/Twist"
    path = tmp_path / "fails.xml"
    code = "if cycles == 1:\n    self.drive.publish(linear={'x': 1.0})\n    self.kept.publish(linear={'x': 1.0})\n"
    code += "    self.far = self.go.send()\ncycles += 1\nif cycles == 4:\n    raise ValueError"
    interfaces = ros("publish", "drive", "/drive", twist) + ros("publish", "unused", "/unused", twist)
    interfaces += ros("publish", "kept", "/kept", twist, "<stop>false</stop>")
    interfaces += ros("action", "go", "/go", "example_interfaces/action/Fibonacci")
    automaton = sub(1, 0, state(1, "one", code, initial=True), variables="cycles = 0")
    path.write_text(document(automaton, head=f"<ros>{interfaces}</ros>"))
    run = behavior(path, on_error="stop")
    action = run.ros.action("/go")
    run.advance(1.0)
    assert run.halted
    assert [each.linear.x for each in run.ros.topic("/drive").messages] == [1.0, 0.0]
    assert [each.linear.x for each in run.ros.topic("/kept").messages] == [1.0]
    assert run.ros.topic("/unused").messages == []
    assert [goal.status for goal in action.goals] == [Status.CANCELED]


def test_a_test_answers_services(behavior: MakeBehavior, tmp_path: Path) -> None:
    run = made(behavior, tmp_path, ros("service", "set", "/set", "std_srvs/srv/SetBool"))
    with pytest.raises(
        CallTimeoutError, match=r"/set: no server within 0\.5 s: give ros\.service\(\) an answer"
    ):
        run.component.set.call(data=True, timeout=0.5)
    service = run.ros.service("/set", lambda request: {"success": request.data, "message": "done"})
    assert run.component.set.call(data=True).success
    assert run.component.set.call_async(data=False).result(0).message == "done"
    assert [request.data for request in service.requests] == [True, False]
    assert [call.data for call in run.calls("/set")] == [True, True, False]
    run.ros.service("/set", lambda _request: {"sucess": True})
    with pytest.raises(MessageError, match="success"):
        run.component.set.call()


def test_what_a_callback_of_a_response_raises_is_an_error_of_the_behavior(
    behavior: MakeBehavior, tmp_path: Path
) -> None:
    code = "self.set.call_async(data=False).add_done_callback(self.hear)"
    service = ros("service", "set", "/set", "std_srvs/srv/SetBool")
    run = made(behavior, tmp_path, service, code=code, functions="def hear(self, done):\n    1 / 0")
    run.ros.service("/set", lambda _request: {"success": True})
    with pytest.raises(BehaviorFailed, match="a callback of its code failed: ZeroDivisionError"):
        run.advance(0.5)


FAILURES = [ZeroDivisionError("a fault"), AssertionError("a fault"), SystemExit("a fault")]


@pytest.mark.parametrize("error", FAILURES, ids=lambda error: type(error).__name__)
@pytest.mark.parametrize("place", ["call", "call_async", "send"])
def test_a_server_that_fails_is_an_error_of_the_call_as_at_a_real_one(
    behavior: MakeBehavior, tmp_path: Path, caplog: pytest.LogCaptureFixture, place: str, error: BaseException
) -> None:
    service = ros("service", "add", "/add", "example_interfaces/srv/AddTwoInts")
    action = ros("action", "go", "/go", "example_interfaces/action/Fibonacci")
    run = made(behavior, tmp_path, service, action)

    def fail(_: object) -> bool:
        raise error

    run.ros.service("/add", fail)
    run.ros.action("/go", fail)
    asked = {
        "call": run.component.add.call,
        "call_async": lambda: run.component.add.call_async().result(0),
        "send": run.component.go.send,
    }
    with pytest.raises(CallError, match=f"the handler failed: {type(error).__name__}: a fault") as found:
        asked[place]()
    assert [call.error for call in run.calls()] == [found.value]
    assert "its handler failed" in caplog.text


@pytest.mark.parametrize("error", [CallTimeoutError("late"), KeyboardInterrupt(), CycleCutError()])
def test_what_a_test_lets_a_call_raise_or_what_ends_the_code_passes(
    behavior: MakeBehavior, tmp_path: Path, error: BaseException
) -> None:
    run = made(behavior, tmp_path, ros("service", "set", "/set", "std_srvs/srv/SetBool"))

    def fail(_: object) -> None:
        raise error

    run.ros.service("/set", fail)
    with pytest.raises(type(error)):
        run.component.set.call()


def test_a_test_carries_out_goals_of_a_projects_own_type(behavior: MakeBehavior, tmp_path: Path) -> None:
    for folder, name, text in (("action", "Count.action", COUNT), ("msg", "Where.msg", "string room\n")):
        (tmp_path / "my_msgs" / folder).mkdir(parents=True)
        (tmp_path / "my_msgs" / folder / name).write_text(text)
    run = made(behavior, tmp_path, ros("action", "count", "/count", "my_msgs/action/Count"))
    action = run.ros.action("/count", accept=lambda goal: goal.number > 0)
    goal = run.component.count.send(number=3, where={"room": "kitchen"})
    assert action.goals[0].request.where.room == "kitchen"
    assert (goal.done, goal.feedback) == (False, None)
    action.goals[0].publish_feedback(now=2)
    assert goal.feedback.now == 2
    later(run, 1.5, lambda: action.goals[0].succeed(reached=3))
    before = run.clock.now()
    assert (goal.result(2.0).reached, goal.status) == (3, Status.SUCCEEDED)
    assert run.clock.now() - before == pytest.approx(1.5, abs=0.02)
    with pytest.raises(GoalRejectedError):
        run.component.count.send(number=0)
    second = run.component.count.send(number=1)
    assert second.cancel()
    assert (second.done, second.status) == (True, Status.CANCELED)


def test_code_waits_for_the_next_message_and_has_the_types(behavior: MakeBehavior, tmp_path: Path) -> None:
    run = made(behavior, tmp_path, ros("subscribe", "text", "text", "std_msgs/msg/String"))
    topic = run.ros.topic("/text")
    assert run.component.text.latest() is None
    assert run.component.text.value.data == ""
    later(run, 0.5, lambda: topic.publish(data="hello"))
    assert run.component.text.next(1.0).value == run.component.ros.make("std_msgs/msg/String", data="hello")
    run.advance(2.0)
    assert run.component.text.latest().age == pytest.approx(2.0)
    with pytest.raises(CallTimeoutError):
        run.component.text.next(0.1)


def test_unknown_names_are_refused(behavior: MakeBehavior, tmp_path: Path) -> None:
    run = made(behavior, tmp_path, ros("subscribe", "text", "/text", "std_msgs/msg/String"))
    with pytest.raises(UnknownName, match=r"uses no topic '/test'; there are /text"):
        run.ros.topic("/test")
    (tmp_path / "plain.xml").write_text(document(sub(1, 0, state(1, "one", initial=True))))
    with pytest.raises(UnknownName, match="no interfaces of ROS"):
        _ = behavior(tmp_path / "plain.xml").ros


def test_a_reloaded_behavior_keeps_what_it_has_and_gets_what_is_new(
    behavior: MakeBehavior, tmp_path: Path
) -> None:
    text = ros("subscribe", "text", "/text", "std_msgs/msg/String")
    run = made(behavior, tmp_path, text)
    run.ros.topic("/text").publish(data="before")
    new = f"<ros>{text}{ros('publish', 'reply', '/reply', 'std_msgs/msg/String')}</ros>"
    code = "self.reply.publish(data=self.text.latest().value.data)"
    (tmp_path / "new.xml").write_text(document(sub(1, 0, state(1, "one", code, initial=True)), head=new))
    run.reload("new.xml")
    run.advance(0.2)
    assert run.ros.topic("/reply").messages[0].data == "before"
    assert isinstance(run.component, Component)


def test_a_goal_is_followed_by_guards(behavior: MakeBehavior, tmp_path: Path) -> None:
    interfaces = ros("action", "go", "/go", "example_interfaces/action/Fibonacci")
    head = f"<ros>{interfaces}</ros>"
    start = "if goal is None:\n    goal = self.go.send(order=5)"
    automaton = sub(
        1,
        0,
        state(1, "going", start, initial=True),
        state(2, "there"),
        transition(1, 1, 2, "goal is not None and goal.done"),
        variables="goal = None",
    )
    (tmp_path / "go.xml").write_text(document(automaton, head=head))
    run = behavior(tmp_path / "go.xml")
    action = run.ros.action("/go")
    run.advance(1.0)
    assert run.active == "going"
    action.goals[0].succeed()
    run.run_until("there", limit=0.2)
    assert len(action.goals) == 1


class UsesRos(Component, document="uses.xml"):
    scan = Ros("subscribe", "/scan", "sensor_msgs/msg/LaserScan")
    drive = Ros("publish", "/cmd_vel", "geometry_msgs/msg/Twist", stop=True)
    switch = Ros("service", "/switch", "std_srvs/srv/SetBool")
    count = Ros("action", "/count", "example_interfaces/action/Fibonacci")


def test_of_ros_everything_is_a_stand_in() -> None:
    world, component = VirtualWorld(stand_ins=True), UsesRos()
    world.connect(component)
    assert component.scan.latest() is None
    component.drive.publish(linear={"x": 1.0})
    assert component.switch.call(data=True).success is False
    assert component.count.send(order=3).done
    before = world.clock.now()
    with pytest.raises(CallTimeoutError):
        component.scan.next(0.05)
    assert world.clock.now() == pytest.approx(before + 0.05)
    world.close()
