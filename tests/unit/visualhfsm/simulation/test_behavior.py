"""A behavior under test: advanced, inspected, and controlled."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from hfsm_runtime.errors import EventError
from tests.support.documents import document, state, sub, transition
from visualhfsm.simulation import simulate
from visualhfsm.simulation._loading import forget, load_component
from visualhfsm.testing import Behavior, BehaviorFailed, DocumentInvalid, MakeBehavior, UnknownName

WALK = document(
    sub(
        1,
        0,
        state(1, "walking", "steps += 1", initial=True, child=2),
        state(2, "resting", "", child=3),
        transition(1, 1, 2, "2000", type="time", name="tired"),
        transition(2, 2, 1, "bell", type="event", name="called", code="calls.append(event.data)"),
        transition(3, 2, 1, "steps > patience", name="enough"),
        variables="steps = 0\ncalls = []\npatience = 100",
    ),
    sub(
        2,
        1,
        state(1, "left", initial=True),
        state(2, "right"),
        transition(1, 1, 2, "300", type="time", name="swap"),
        transition(2, 2, 1, "300", type="time", name="swap"),
    ),
    sub(3, 1, state(1, "sitting", "looks = looks + 1", initial=True), variables="looks = 0"),
    head=(
        "<parameters><parameter><name>speed</name><type>float</type><default>0.5</default></parameter>"
        "</parameters><events><event><name>bell</name></event></events>"
    ),
)


@pytest.fixture
def walk(tmp_path: Path) -> Path:
    path = tmp_path / "walk.xml"
    path.write_text(WALK, encoding="utf-8")
    return path


@pytest.fixture
def b(behavior: MakeBehavior, walk: Path) -> Behavior:
    return behavior(walk)


def write(directory: Path, *parts: str) -> Path:
    path = directory / "written.xml"
    path.write_text(document(*parts), encoding="utf-8")
    return path


class TestCode:
    def test_dataclasses_and_pickles_find_the_module_of_a_class(
        self, behavior: MakeBehavior, tmp_path: Path
    ) -> None:
        def ball(default: int) -> Path:
            point = f"from dataclasses import dataclass\n@dataclass\nclass Point:\n    x: int = {default}"
            find = "import pickle, sys\nmodule = pickle.loads(pickle.dumps(type(self))).__module__"
            code = f"{point}\nx = Point().x\n{find}\nfound = module in sys.modules"
            variables = f"{point}\nat = Point()\nx = found = module = 0"
            return write(tmp_path, sub(1, 0, state(1, "only", code, initial=True), variables=variables))

        b = behavior(ball(7))
        b.advance(0.0)
        assert (b.variables("written")["x"], b.variables("written")["found"]) == (7, True)
        b.reload(ball(8))
        b.advance(0.1)
        assert (b.variables("written")["x"], b.variables("written")["found"]) == (8, True)


class TestTime:
    def test_nothing_runs_before_the_time_is_moved_on(self, b: Behavior) -> None:
        assert (b.time, b.active, b.variables("walk")["steps"]) == (0.0, "walking/left", 0)

    def test_cycles_run_at_their_times_the_end_included(self, b: Behavior) -> None:
        b.advance(0.0)
        assert b.variables("walk")["steps"] == 1
        b.advance(0.3)
        assert (b.variables("walk")["steps"], b.active) == (4, "walking/right")

    def test_it_runs_until_a_condition_holds(self, b: Behavior) -> None:
        assert b.run_until("resting") == 2.0
        assert b.run_until(lambda: b.variables("resting")["looks"] == 5, limit=1.0) == pytest.approx(2.4)
        assert b.run_until(lambda b: b.time >= 2.45) == pytest.approx(2.5)

    def test_a_condition_that_holds_takes_no_time(self, b: Behavior) -> None:
        assert b.run_until("walking") == 0.0
        assert b.variables("walk")["steps"] == 0

    def test_what_never_comes_true_shows_the_timeline(self, b: Behavior) -> None:
        with pytest.raises(BehaviorFailed) as failure:
            b.run_until("resting", limit=1.0)
        reported = str(failure.value)
        assert reported.startswith(
            "the state resting was not reached within 1 s: at 1.000 s the behavior is in walking/right\n"
        )
        assert "0.900 s    walking: left -> right  by swap after 0.3 s" in reported

    @pytest.mark.slow
    def test_the_same_happens_every_time(self, behavior: MakeBehavior) -> None:
        def run() -> tuple[object, ...]:
            b = behavior("behaviors/dance_and_follow.xml", robot="fake")
            b.robot.ball("red").move(pan=-1.0, speed=0.3)
            b.advance(12.0)
            return b.trace, [str(call) for call in b.calls()], b.robot.joints

        assert run() == run()

    @pytest.mark.sim
    def test_the_same_happens_every_time_in_the_simulation(self, behavior: MakeBehavior) -> None:
        def run() -> tuple[object, ...]:
            b = behavior("behaviors/follow_ball.xml", robot="sim", camera="drawn")
            b.robot.ball("green").move(pan=-1.0, speed=0.3)
            b.advance(3.0)
            return b.trace, [str(call) for call in b.calls()], b.robot.joints

        assert run() == run()


class TestLooking:
    def test_paths_lead_to_states_and_to_what_is_below(self, b: Behavior) -> None:
        assert b.is_active("walking")
        assert b.is_active("walking/left")
        assert not b.is_active("walk")
        assert not b.is_active("left")
        assert b.active_paths == ("walking/left",)

    def test_an_automaton_is_known_by_name_path_and_id(self, b: Behavior) -> None:
        b.advance(0.3)
        assert b.state("walking") == b.state(2) == "right"
        assert b.state("walk") == b.state("") == b.state(1) == "walking"
        assert b.is_ghost("resting")
        assert not b.is_ghost("walking")
        with pytest.raises(UnknownName, match="no automaton 'flying'; there are walk, walking, resting"):
            b.state("flying")

    def test_automata_of_one_name_are_distinguished_by_their_paths(
        self, behavior: MakeBehavior, tmp_path: Path
    ) -> None:
        path = write(
            tmp_path,
            sub(1, 0, state(1, "a", initial=True, child=2), state(2, "b", child=3)),
            sub(2, 1, state(1, "x", initial=True, child=4)),
            sub(3, 1, state(1, "x", initial=True, child=5)),
            sub(4, 2, state(1, "first", initial=True)),
            sub(5, 3, state(1, "second", initial=True)),
        )
        b = behavior(path)
        assert (b.state("a/x"), b.state("b/x")) == ("first", "second")
        with pytest.raises(UnknownName, match="name one by its path: a/x, b/x"):
            b.state("x")

    def test_changes_transitions_and_trace(self, b: Behavior) -> None:
        b.advance(2.0)
        assert b.changes("walk") == [(0.0, "walking"), (2.0, "resting")]
        assert [(fired.time, fired.transition) for fired in b.fired if fired.automaton == "walk"] == [
            (2.0, "tired")
        ]
        assert [change.kind for change in b.trace if change.automaton == "walking"][-1] == "ghost"

    def test_the_timeline_reports_what_happened_and_what_the_test_did(self, b: Behavior) -> None:
        b.set("walk", steps=7)
        b.advance(2.0)
        b.send("bell", 3)
        b.advance(0.1)
        assert b.timeline.splitlines()[0] == "timeline of walk, 2.100 s, in walking/left"
        assert "     0.000 s  the test sets steps of walk to 7" in b.timeline
        assert "     2.000 s  event bell with 3" in b.timeline
        assert "     2.100 s  walk: resting -> walking  by called at event bell" in b.timeline


class TestDoing:
    def test_a_variable_that_is_set(self, b: Behavior) -> None:
        b.set("walk", steps=41)
        b.advance(0.0)
        assert b.variables("walk")["steps"] == 42

    def test_an_event_comes_with_its_data(self, b: Behavior) -> None:
        b.run_until("resting")
        b.send("bell", {"loud": True})
        b.advance(0.1)
        assert b.active == "walking/left"
        assert b.variables("walk")["calls"] == [{"loud": True}]
        with pytest.raises(EventError):
            b.send("bell", object())

    def test_a_transition_that_is_forced(self, b: Behavior) -> None:
        b.force("walk", "tired")
        b.advance(0.0)
        assert b.active == "resting/sitting"
        with pytest.raises(
            UnknownName, match="no transition 'tired' leaves resting; there are called, enough"
        ):
            b.force("walk", "tired")

    def test_a_guard_that_is_set_and_given_back(self, b: Behavior) -> None:
        b.run_until("resting")
        assert b.guards == ("enough",)
        b.guard("enough", True)
        b.advance(0.1)
        assert b.active == "walking/left"
        b.guard("enough", False)
        b.set("walk", patience=10)
        b.run_until("resting")
        b.advance(1.0)
        assert b.active == "resting/sitting"
        b.guard("enough", None)
        b.advance(0.1)
        assert b.is_active("walking")
        with pytest.raises(UnknownName, match="no guard 'swap'; there are enough"):
            b.guard("swap", True)

    def test_parameters(self, behavior: MakeBehavior, walk: Path) -> None:
        assert behavior(walk).component.speed == 0.5
        assert behavior(walk, parameters={"speed": 0.25}).component.speed == 0.25
        with pytest.raises(UnknownName, match="no parameter 'sped'; there are speed"):
            behavior(walk, parameters={"sped": 1.0})

    def test_a_component_goes_on_with_an_edited_document(self, behavior: MakeBehavior, walk: Path) -> None:
        b = behavior(walk)
        b.advance(1.0)
        edited = WALK.replace("steps += 1", "steps += 10").replace("2000", "1500")
        (walk.parent / "edited.xml").write_text(edited, encoding="utf-8")
        b.reload("edited.xml")
        b.advance(0.1)
        assert b.variables(1)["steps"] == 21
        assert b.run_until("resting") == 1.5
        (walk.parent / "broken.xml").write_text("<VisualHFSM>", encoding="utf-8")
        with pytest.raises(DocumentInvalid):
            b.reload("broken.xml")
        assert b.active == "resting/sitting"


class TestErrors:
    FAILING = sub(1, 0, state(1, "only", "n += 1\nif n == 3:\n    1 / 0", initial=True), variables="n = 0")

    def test_an_exception_of_its_code_fails_the_test(self, behavior: MakeBehavior, tmp_path: Path) -> None:
        b = behavior(write(tmp_path, self.FAILING))
        with pytest.raises(BehaviorFailed, match="code of written raised ZeroDivisionError") as failure:
            b.advance(1.0)
        assert "written.py" in str(failure.value)
        assert "(written.xml:5)" in str(failure.value)
        assert isinstance(failure.value.__cause__, ZeroDivisionError)

    def test_unless_the_test_says_what_follows(self, behavior: MakeBehavior, tmp_path: Path) -> None:
        path = write(tmp_path, self.FAILING)
        goes_on = behavior(path, on_error="continue")
        goes_on.advance(1.0)
        assert goes_on.variables("written")["n"] == 11
        assert [error.time for error in goes_on.errors] == [0.2]
        halts = behavior(path, on_error="stop")
        halts.advance(1.0)
        assert halts.halted
        assert halts.variables("written")["n"] == 3

    def test_its_code_cannot_end_the_test(self, behavior: MakeBehavior, tmp_path: Path) -> None:
        b = behavior(write(tmp_path, sub(1, 0, state(1, "only", "import sys\nsys.exit(3)", initial=True))))
        with pytest.raises(BehaviorFailed, match=r"sys\.exit\(3\) ends the component") as failure:
            b.advance(1.0)
        assert "(written.xml:4)" in str(failure.value)

    def test_it_ends_with_the_final_state(self, behavior: MakeBehavior, tmp_path: Path) -> None:
        final = state(2, "end").replace("<code>", "<final>true</final><code>")
        b = behavior(
            write(tmp_path, sub(1, 0, state(1, "go", initial=True), final, transition(1, 1, 2, "True")))
        )
        b.advance(1.0)
        assert b.finished
        with pytest.raises(BehaviorFailed, match=r"at 1\.000 s the behavior has finished in end"):
            b.run_until("go")

    def test_a_document_with_errors(self, behavior: MakeBehavior, tmp_path: Path) -> None:
        with pytest.raises(DocumentInvalid, match=r"written\.xml:3"):
            behavior(write(tmp_path, sub(1, 0, state(1, "only", "if", initial=True))))
        with pytest.raises(FileNotFoundError, match=r"no document nowhere\.xml; looked for"):
            behavior("nowhere.xml")

    def test_a_behavior_without_a_robot_says_so(self, b: Behavior) -> None:
        with pytest.raises(UnknownName, match="robot='fake' or robot='sim'"):
            _ = b.robot


class TestRobot:
    @pytest.fixture
    def b(self, behavior: MakeBehavior, walk: Path) -> Behavior:
        return behavior(walk, robot="fake")

    def test_balls_are_placed_moved_and_hidden(self, b: Behavior) -> None:
        ball = b.robot.ball("green")
        ball.place(pan=0.5, height=0.9)
        assert ball.position == pytest.approx((0.5, 1.0, 0.9))
        ball.move(pan=0.0, speed=0.5)
        b.advance(0.5)
        assert ball.position[0] == pytest.approx(0.25, abs=0.02)
        ball.hide()
        assert b.robot.look().pixels.reshape(-1, 3)[:, 1].max() < 150
        assert b.robot.ball("BallGreen").position == ball.position
        with pytest.raises(UnknownName, match="no ball 'blue'; there are BallRed, BallGreen"):
            b.robot.ball("blue")

    @pytest.mark.sim
    @pytest.mark.gl
    def test_a_drawn_image_of_the_simulation_shows_the_balls_where_a_rendered_one_does(
        self, behavior: MakeBehavior, walk: Path
    ) -> None:
        seen = []
        for camera in ("drawn", "rendered"):
            b = behavior(walk, robot="sim", camera=camera)
            b.robot.place(HeadYaw=0.2, HeadPitch=0.1)
            b.robot.ball("green").place(pan=0.3, distance=1.2, height=0.5)
            pixels = b.robot.look().pixels.astype(int)
            rows, columns = np.nonzero(pixels[..., 1] > pixels[..., [0, 2]].max(axis=2) + 60)
            seen.append((columns.mean(), rows.mean(), len(rows) ** 0.5))
        assert seen[0] == pytest.approx(seen[1], abs=1.0)

    def test_joints_are_placed_and_read(self, b: Behavior) -> None:
        b.robot.place(HeadYaw=0.25, LShoulderPitch=1.0)
        assert b.robot.head[0] == b.robot.joint("HeadYaw") == 0.25
        assert b.robot.joints["LShoulderPitch"] == 1.0
        with pytest.raises(UnknownName, match="no joint 'Tail'"):
            b.robot.joint("Tail")


class TestSimulate:
    def test_a_document_runs_in_plain_python(self, walk: Path) -> None:
        with simulate(walk, parameters={"speed": 0.7}) as b:
            b.run_until("resting/sitting")
            assert b.component.speed == 0.7
            module = type(b.component).__module__
            assert module in sys.modules
        assert module not in sys.modules

    def test_a_component_runs_too_and_its_module_stays(self, walk: Path) -> None:
        component = load_component(walk)
        for _ in range(2):
            with simulate(component, robot="fake", posture={"HeadYaw": 0.3}) as b:
                b.advance(1.0)
                assert b.robot.joint("HeadYaw") == 0.3
        assert component.__module__ in sys.modules
        forget(component)

    def test_nothing_is_left_of_one_that_cannot_be_made(self, walk: Path) -> None:
        before = set(sys.modules)
        with pytest.raises(UnknownName, match="no parameter 'color'"):
            simulate(walk, parameters={"color": 1})
        assert not {name for name in set(sys.modules) - before if "walk" in name}
