"""Random runs find what a behavior must not do, and report the shortest run that leads to it."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import pytest
from hypothesis import Phase, find, given, settings
from hypothesis import strategies as st

from tests.support.documents import document, state, sub, transition
from tests.support.examples import examples
from visualhfsm.simulation._loading import read
from visualhfsm.testing import Behavior, BehaviorFailed, DocumentInvalid, check_properties
from visualhfsm.testing._abstraction import abstract_component
from visualhfsm.testing.strategies import Move, advances, balls, events, guard_scripts, guards, stimuli

DOOR = (
    sub(
        1,
        0,
        state(1, "closed", initial=True),
        state(2, "open", child=2),
        transition(1, 1, 2, "self.pushed()", name="push"),
        transition(2, 2, 1, "5000", type="time", name="shut"),
        transition(3, 2, 1, "alarm", type="event", name="slam"),
    ),
    sub(
        2,
        1,
        state(1, "quiet", initial=True),
        state(2, "ringing"),
        transition(1, 1, 2, "2000", type="time", name="ring"),
        transition(2, 2, 1, "self.muted()", name="mute"),
        period="50",
    ),
)


def write(path: Path, *properties: str, parts: tuple[str, ...] = DOOR) -> Path:
    found = "".join(properties)
    path.write_text(document(*parts, head=f"<properties>{found}</properties>"), encoding="utf-8")
    return path


def stated(kind: str, expression: str, within: str = "") -> str:
    return (
        f'<property kind="{kind}"><name>p</name><within>{within}</within>'
        f"<expression>{expression}</expression></property>"
    )


@pytest.fixture
def door(tmp_path: Path) -> Path:
    return write(tmp_path / "door.xml")


# To explain what was found takes longer than all the rest.
smallest = partial(find, settings=settings(max_examples=2000, phases=(Phase.generate, Phase.shrink)))


class TestStrategies:
    def test_guards_are_named_by_their_paths(self, door: Path) -> None:
        found = smallest(guards(door), lambda values: all(values.values()))
        assert found == {"push": True, "open/mute": True}

    def test_guard_scripts_are_values_and_the_times_they_stay(self, door: Path) -> None:
        script = smallest(guard_scripts(door), lambda script: len(script) == 2)
        assert script == [({"push": False, "open/mute": False}, 0.05)] * 2

    def test_time_passes_in_periods_and_as_long_as_the_timers_take(self, door: Path) -> None:
        assert smallest(advances(door), lambda _: True) == Move("advance", (0.05,))
        assert smallest(advances(door), lambda step: step.arguments == (5.0,)) == Move("advance", (5.0,))

    def test_events_are_those_that_something_waits_for(self, door: Path) -> None:
        assert smallest(events(door), lambda _: True) == Move("send", ("alarm",))

    def test_balls_are_put_in_front_of_the_robot_or_behind_it(self) -> None:
        assert (
            repr(smallest(balls("red"), lambda step: "place" in repr(step)))
            == "b.robot.ball('red').place(0, 0.6, 0.2)"
        )
        assert repr(smallest(balls("red"), lambda step: "hide" in repr(step))) == "b.robot.ball('red').hide()"

    @pytest.mark.slow
    @given(data=st.data())
    @settings(max_examples=examples(8), deadline=None)
    def test_any_sequence_of_stimuli_can_be_taken(self, data: st.DataObject) -> None:
        path = Path("behaviors/dance_and_follow.xml")
        b = Behavior(abstract_component(read(path), path)())
        for step in data.draw(stimuli(path, max_size=10)):
            step.apply(b)
        assert b.active_paths


class TestAbstraction:
    def test_it_has_the_timers_and_events_and_none_of_the_code(self, door: Path) -> None:
        b = Behavior(abstract_component(read(door), door)())
        b.advance(10.0)
        assert b.changes("door") == [(0.0, "closed")]
        b.guard("push", True)
        b.advance(2.2)
        b.guard("push", False)
        assert b.active == "open/ringing"
        b.guard("mute", True)
        b.advance(0.05)
        assert b.active == "open/quiet"
        b.send("alarm")
        b.advance(0.1)
        assert b.active == "closed"

    @pytest.mark.slow
    def test_the_paths_of_real_and_abstract_runs_agree_for_the_same_guards(self) -> None:
        from visualhfsm.simulation._loading import load_component

        path = Path("behaviors/dance_and_follow.xml")
        real = Behavior(load_component(path)(), robot="fake")
        abstract = Behavior(abstract_component(read(path), path)())
        for b in (real, abstract):
            for name in b.guards:
                b.guard(name, False)
        real.advance(9.9)
        abstract.advance(9.9)
        assert [tuple(change) for change in real.trace] == [tuple(change) for change in abstract.trace]


class TestCheckProperties:
    def test_what_holds_passes(self, door: Path) -> None:
        check_properties(door, lambda b: b.is_active("open") != b.is_active("closed"), examples=30)

    @pytest.mark.slow
    def test_the_steps_to_a_counterexample_are_few(self, door: Path) -> None:
        def never_rings(b: Behavior) -> bool:
            return not b.is_active("open/ringing")

        with pytest.raises(BehaviorFailed) as failure:
            check_properties(door, never_rings)
        head, *steps = str(failure.value).split("timeline")[0].strip().splitlines()
        assert head.startswith("never_rings does not hold at ")
        assert head.endswith("in open/ringing; steps:")
        assert sorted(step.strip() for step in steps)[-1] == "b.guard('push', True)"
        assert len(steps) <= 4

    @pytest.mark.slow
    def test_an_assertion_reports_more(self, door: Path) -> None:
        def shut(b: Behavior) -> None:
            assert b.active == "closed", "somebody opened it"

        with pytest.raises(BehaviorFailed, match="shut: somebody opened it"):
            check_properties(door, shut)

    def test_the_start_is_looked_at_too(self, door: Path) -> None:
        with pytest.raises(BehaviorFailed, match=r"at 0 s, in closed; steps:\n    \(none\)"):
            check_properties(door, lambda b: b.time > 0)

    def test_properties_of_the_document_that_hold(self, tmp_path: Path) -> None:
        holding = (
            stated("never", "closed and active(open)"),
            stated("always", "open/ringing -&gt; open"),
            stated("never", "open/ringing", within="1900"),
            stated("eventually", "closed", within="100"),
        )
        check_properties(write(tmp_path / "door.xml", *holding), examples=30)

    @pytest.mark.slow
    @pytest.mark.parametrize(
        ("broken", "text"),
        [
            (stated("never", "open/ringing"), r"property 'p' \(never open/ringing\) does not hold"),
            (stated("always", "closed"), r"property 'p' \(always closed\) does not hold"),
            (
                stated("eventually", "open", within="300"),
                r"property 'p' \(eventually open\) does not hold at 0.3 s",
            ),
        ],
        ids=["never", "always", "eventually"],
    )
    def test_properties_of_the_document_that_do_not_hold(
        self, tmp_path: Path, broken: str, text: str
    ) -> None:
        with pytest.raises(BehaviorFailed, match=text):
            check_properties(write(tmp_path / "door.xml", broken))

    def test_a_property_that_cannot_be_understood(self, tmp_path: Path) -> None:
        with pytest.raises(DocumentInvalid, match=r"door.xml:1: property 'p' .* no state `ajar`"):
            check_properties(write(tmp_path / "door.xml", stated("never", "ajar")))

    def test_code_that_fails_is_found_with_the_steps_to_it(self, tmp_path: Path) -> None:
        fragile = sub(
            1,
            0,
            state(1, "fine", initial=True),
            state(2, "rung", "1 / 0"),
            transition(1, 1, 2, "bell", type="event"),
        )
        path = write(tmp_path / "fragile.xml", parts=(fragile,))
        with pytest.raises(BehaviorFailed, match="raised ZeroDivisionError") as failure:
            check_properties(path, abstract=False)
        assert str(failure.value).endswith("steps:\n    b.send('bell')\n    b.advance(0.1)")

    def test_guards_run_their_code_unless_they_are_to_be_random(self, tmp_path: Path) -> None:
        never = sub(1, 0, state(1, "a", initial=True), state(2, "b"), transition(1, 1, 2, "1 > 2", name="go"))
        path = write(tmp_path / "never.xml", parts=(never,))

        def stays(b: Behavior) -> bool:
            return b.active == "a"

        check_properties(path, stays, abstract=False, examples=20)
        with pytest.raises(BehaviorFailed, match=r"b\.guard\('go', True\)"):
            check_properties(path, stays, abstract=False, guards=True)


def test_code_that_runs_gets_events_from_outside_alone_and_logs_nothing_meanwhile(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    ways = (
        transition(1, 1, 2, "inner", type="event").replace(
            "</transition>", "<guard>event.data[0]</guard></transition>"
        ),
        transition(2, 2, 1, "outer", type="event"),
    )
    parts = sub(1, 0, state(1, "a", 'self.send("inner", [True])', initial=True), state(2, "b"), *ways)
    outer = "<events><event><name>outer</name></event></events>"
    path = tmp_path / "letters.xml"
    path.write_text(document(parts, head=outer), encoding="utf-8")
    check_properties(path, abstract=False, examples=20)
    path.write_text(document(parts, head=outer.replace("outer", "inner")), encoding="utf-8")
    with pytest.raises(BehaviorFailed, match="raised TypeError: 'NoneType'"):
        check_properties(path, abstract=False, examples=20)
    assert not caplog.records


def test_steps_print_as_the_code_that_repeats_them() -> None:
    assert repr(Move("advance", (0.25,))) == "b.advance(0.25)"
    assert repr(Move("guard", ("open/mute", True))) == "b.guard('open/mute', True)"
    assert repr(Move("send", ("bell",))) == "b.send('bell')"
