"""Another version of a component continues where the previous one was, in virtual time."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

import pytest

from hfsm_runtime import Automaton, Component, Input, Output, Parameter, Proxy, State, Transition
from hfsm_runtime.errors import ReloadRefusedError
from hfsm_runtime.tree import ChangeKind
from hfsm_runtime.virtual import Execution
from tests.support.gripper import GripperPrx


def component(make: Callable[[Any], Automaton], **members: Any) -> Any:
    """Return a component of one version of a document; `members` are its parameters, proxies and functions."""

    class Version(Component, document="walker.xml"):
        def automaton(self) -> Automaton:
            return make(self)

    for name, value in members.items():
        setattr(Version, name, value)
        if isinstance(value, Parameter | Proxy):
            value.__set_name__(Version, name)
    return Version()


def timed(
    *names: str,
    seconds: float = 10.0,
    id: int = 1,
    name: str = "walker",
    period: float = 0.1,
    children: dict[str, Automaton] | None = None,
    **states: Any,
) -> Automaton:
    """Return an automaton that goes from each state to the next after a time, and from the last to the first."""
    children = children or {}
    return Automaton(
        id=id,
        name=name,
        period=period,
        states=tuple(
            State(
                id=number, name=state, initial=number == 1,
                children=(children[state],) if state in children else (), **states.get(state, {}),
            )
            for number, state in enumerate(names, 1)
        ),
        transitions=tuple(
            Transition(id=n, name=f"after {state}", origin=n, destination=n % len(names) + 1, seconds=seconds)
            for n, state in enumerate(names, 1)
        ),
    )  # fmt: skip


def user(run: Execution) -> Any:
    """Return what user code sees as `self`."""
    return run.component


def running(automaton: Automaton, seconds: float) -> Execution:
    run = Execution(component(lambda self: automaton))
    run.advance(seconds)
    return run


def reload(run: Execution, automaton: Automaton) -> tuple[str, ...]:
    return run.exchange(component(lambda self: automaton))


def test_a_state_is_kept_with_the_time_that_was_spent_in_it() -> None:
    run = running(timed("follow", "dance"), 16.0)
    assert run.active == "dance"
    assert reload(run, timed("follow", "dance", seconds=20.0)) == ()
    assert run.active == "dance"
    run.advance(13.9)
    assert run.active == "dance"
    run.advance(0.2)  # 20 s since 10.0 are over
    assert run.active == "follow"


def test_a_time_that_is_over_in_the_new_version_fires_at_the_next_cycle() -> None:
    run = running(timed("follow", "dance"), 8.0)
    reload(run, timed("follow", "dance", seconds=5.0))
    run.advance(0.1)
    assert run.active == "dance"


def test_states_are_found_by_id_and_then_by_their_name() -> None:
    renamed = timed("follow", "salsa")
    run = running(timed("follow", "dance"), 16.0)
    assert reload(run, renamed) == ()
    assert run.active == "salsa"
    moved = Automaton(
        id=1, name="walker",
        states=(State(id=7, name="rest", initial=True), State(id=9, name="salsa")),
        transitions=(Transition("", 9, 7, id=1, seconds=10.0),),
    )  # fmt: skip
    assert reload(run, moved) == ()
    assert run.active == "salsa"
    run.advance(4.1)
    assert run.active == "rest"


def test_an_automaton_whose_state_is_gone_restarts_and_it_is_reported() -> None:
    entered: list[str] = []
    left = {"exit": lambda: entered.append("left")}
    run = running(timed("follow", "dance", "rest", dance=left), 16.0)
    new = timed("start", "follow", start={"entry": lambda: entered.append("start")})
    new = Automaton(id=1, name="walker", states=(new.states[0], State(id=9, name="follow")))
    (reported,) = reload(run, new)
    assert reported == (
        "automaton 1 (walker) was in the state dance, which is gone, and restarts in start; "
        "its exit code did not run"
    )
    run.advance(0.1)
    assert run.active == "start"
    assert entered == ["start"]


def test_the_timers_of_an_automaton_that_restarts_count_from_then_on() -> None:
    run = running(timed("follow", "dance"), 16.0)
    rest = State(id=7, name="rest", initial=True, children=(timed("x", "y", id=2, name="rest", seconds=1.0),))
    new = Automaton(
        id=1, name="walker", states=(rest, State(id=8, name="over")),
        transitions=(Transition("", 7, 8, id=1, seconds=3.0),),
    )  # fmt: skip
    reload(run, new)
    assert run.active == "rest/x"
    run.advance(1.1)
    assert run.active == "rest/y"
    run.advance(2.0)
    assert run.active == "over"


def test_two_states_of_one_name_are_not_mistaken_for_each_other() -> None:
    run = running(timed("follow", "dance"), 16.0)
    states = (State(id=5, name="rest", initial=True), State(id=6, name="dance"), State(id=7, name="dance"))
    (reported,) = reload(run, Automaton(id=1, name="walker", states=states))
    assert "restarts in rest" in reported


def test_ghosts_keep_their_state_and_their_timers() -> None:
    def version(seconds: float = 8.0) -> Automaton:
        colors = timed("red", "green", seconds=seconds, id=2, name="follow")
        return timed("follow", "dance", children={"follow": colors})

    run = running(version(), 12.0)
    ghost = run.tree.actors[1]
    assert (run.active, ghost.active, ghost.current.name) == ("dance", False, "green")
    assert reload(run, version()) == ()
    assert (run.active, ghost.active, ghost.current.name) == ("dance", False, "green")
    run.advance(13.9)  # it was green for 2 s, so 6 s are left when follow comes back at 20
    assert run.active == "follow/green"
    run.advance(0.2)
    assert run.active == "follow/red"


def test_automata_that_are_new_run_and_those_that_are_gone_do_not() -> None:
    ran: list[str] = []

    def child(id: int, name: str) -> Automaton:
        return timed("a", "b", id=id, name=name, a={"code": lambda: ran.append(name)})

    run = running(timed("follow", "dance", children={"follow": child(2, "old")}), 1.0)
    assert set(ran) == {"old"}
    ran.clear()
    old = run.tree.actors[1]
    (reported,) = reload(run, timed("follow", "dance", children={"follow": child(3, "new")}))
    assert not run.tree.begin_cycle(old)  # as its thread may ask at this very moment
    run.advance(1.0)
    assert reported == "automaton 2 (old) is gone, which was in a"
    assert ran == ["new"] * 10
    assert [run.automaton.id for run in run.tree.actors] == [1, 3]
    assert run.tree.actor(2) is None


@pytest.mark.parametrize("before", [(), (timed("b", id=3, name="leaf"),)], ids=["new", "without its state"])
def test_an_automaton_that_a_ghost_gets_enters_its_state_when_it_wakes(before: tuple[Automaton, ...]) -> None:
    ran: list[str] = []
    first = State("a", id=7, initial=True, entry=lambda: ran.append("entry"), code=lambda: ran.append("code"))
    leaf = Automaton(id=3, name="leaf", states=(first,))

    def version(*leaves: Automaton) -> Automaton:
        middle = Automaton(id=2, name="middle", states=(State("m", initial=True, children=leaves),))
        return timed("follow", "dance", seconds=1.0, children={"follow": middle})

    run = running(version(*before), 1.5)
    reload(run, version(leaf))
    run.advance(0.6)
    assert ran == ["entry", "code", "code"]
    assert run.changes("leaf")[-1] == (2.0, "a")


def test_an_automaton_that_moves_below_another_state_goes_on() -> None:
    colors = timed("red", "green", seconds=3.0, id=2, name="colors")
    run = running(timed("follow", "dance", children={"follow": colors}), 4.0)
    assert run.active == "follow/green"
    reload(run, timed("follow", "dance", children={"dance": colors}))
    assert (run.active, run.tree.actors[1].active) == ("follow", False)
    run.advance(6.5)
    assert run.active == "dance/green"


def test_an_unchanged_automaton_runs_every_cycle_and_counts_on() -> None:
    run = running(timed("follow", "dance"), 0.55)
    cycles = run.tree.root.cycle.count
    reload(run, timed("follow", "dance"))
    run.advance(0.5)
    assert run.tree.root.cycle.count == cycles + 5


def test_a_period_that_changed_counts_from_then_on() -> None:
    run = running(timed("follow", "dance", period=0.1), 1.0)
    reload(run, timed("follow", "dance", period=0.02))
    before = run.tree.root.cycle.count
    run.advance(1.0)
    assert run.tree.root.cycle.count == before + 50


def counting(
    self: Any, *, first: int = 0, step: int = 1, limits: Iterable[int] = (1, 2), **_: Any
) -> Automaton:
    count = first
    table = list(limits)
    late: int

    def scale(value: int) -> int:
        return value * step

    def code() -> None:
        nonlocal count, late
        count += scale(1)
        late = count
        self.seen = (count, list(table), late)

    return Automaton(id=1, name="walker", states=(State(id=1, name="a", initial=True, code=code),))


def test_variables_are_kept_and_code_is_new() -> None:
    run = Execution(component(counting))
    run.advance(0.4)
    assert user(run).seen == (5, [1, 2], 5)
    assert run.exchange(component(lambda self: counting(self, step=10))) == ()
    run.advance(0.1)
    assert user(run).seen == (15, [1, 2], 15)


def test_variables_that_nobody_changed_get_the_value_of_the_new_version() -> None:
    run = Execution(component(counting))
    run.advance(0.4)
    run.exchange(component(lambda self: counting(self, first=100, limits=(7,))))
    run.advance(0.1)
    assert user(run).seen == (6, [7], 6)  # the count was changed, the table was not
    run.exchange(component(lambda self: counting(self, first=100, limits=(8,))))
    run.advance(0.1)
    assert user(run).seen == (7, [8], 7)


def test_a_variable_that_has_no_first_value_keeps_its_value() -> None:
    def version(self: Any) -> Automaton:
        found: int

        def entry() -> None:
            nonlocal found
            found = 7

        def code() -> None:
            self.seen = found

        return Automaton(
            id=1, name="walker", states=(State(id=1, name="a", initial=True, entry=entry, code=code),)
        )  # fmt: skip

    run = Execution(component(version))
    run.advance(0.1)
    run.exchange(component(version))
    vars(run.component).clear()
    run.advance(0.1)
    assert run.errors == ()
    assert user(run).seen == 7


def test_a_list_that_was_changed_in_place_is_kept() -> None:
    def version(self: Any, *beginning: int) -> Automaton:
        found = list(beginning)

        def code() -> None:
            found.append(3)
            self.found = found

        return Automaton(id=1, name="walker", states=(State(id=1, name="a", initial=True, code=code),))

    run = Execution(component(lambda self: version(self, 1)))
    run.advance(0.0)
    run.exchange(component(lambda self: version(self, 2)))
    run.advance(0.1)
    assert user(run).found == [1, 3, 3]


def test_variables_that_are_gone_are_reported() -> None:
    run = Execution(component(counting))
    run.advance(0.1)
    (reported,) = reload(run, timed("follow", "dance"))
    assert reported == "no code of automaton 1 (walker) uses count, late, table any more"


def test_attributes_of_self_are_one_and_the_same_for_both_versions() -> None:
    old = component(lambda self: timed("follow", "dance"))
    run = Execution(old)
    old.camera = model = object()
    new = component(lambda self: timed("follow", "dance"), turn=lambda self: None)
    old.turn = 3
    assert run.exchange(new) == ("self.turn was an attribute, and is now defined by the document",)
    assert new.camera is model
    assert callable(new.turn)
    old.later = 5  # as a callback of the old version does
    assert new.later == 5


def test_parameters_keep_their_values_while_their_type_stays() -> None:
    def version(**parameters: object) -> Any:
        declared = {name: Parameter(default) for name, default in parameters.items()}
        return component(lambda self: timed("follow", "dance"), **declared)

    old = version(speed=0.3, turns=3, color="red", gone=1)
    old.speed, old.turns = 0.5, 5
    run = Execution(old)
    new = version(speed=0.1, turns="many", color="green")
    assert sorted(run.exchange(new)) == [
        "the parameter gone is gone", "the parameter turns is str now and has its default again"
    ]  # fmt: skip
    assert (new.speed, new.turns, new.color) == (0.5, "many", "green")


def test_proxies_are_kept_while_they_are_of_the_same_servant() -> None:
    old = component(lambda self: timed("a", "b"), hand=Proxy("Hand", GripperPrx), arm=Proxy("L", GripperPrx))
    with Execution(old) as run:
        hand = old.hand
        new = component(lambda self: timed("a"), hand=Proxy("Hand", GripperPrx), arm=Proxy("R", GripperPrx))
        run.exchange(new)
        assert new.hand is hand
        assert new.arm.ice_getIdentity() == "R"


def test_a_servant_that_the_new_version_has_no_proxy_of_is_stopped() -> None:
    def version(**names: str) -> Any:
        proxies = {name: Proxy(identity, GripperPrx) for name, identity in names.items()}
        return component(lambda self: timed("a"), **proxies)

    stubs = {"Hand": {"stop": None}, "Arm": {"stop": None}}
    with Execution(version(hand="Hand", arm="Arm"), stubs=stubs) as run:
        run.exchange(version(paw="Hand"))
        assert [call.target for call in run.calls()] == ["Arm.stop"]


@pytest.mark.parametrize(("seconds", "stopped"), [(0.2, ["Hand.stop"]), (0.7, [])], ids=["active", "ghost"])
@pytest.mark.parametrize("after", [(), ("c", "y")], ids=["automaton", "state"])
def test_everything_is_stopped_where_an_active_state_with_exit_code_is_gone(
    after: tuple[str, ...], seconds: float, stopped: list[str]
) -> None:
    def version(*below: str) -> Any:
        def make(self: Any) -> Automaton:
            states = tuple(
                State(name, id=ord(name), initial=each == 0, exit=lambda: None)
                for each, name in enumerate(below)
            )
            children = {"a": Automaton("child", id=2, states=states)} if below else None
            return timed("a", "b", seconds=0.5, children=children)

        return component(make, hand=Proxy("Hand", GripperPrx))

    with Execution(version("x", "y"), stubs={"Hand": {"stop": None}}) as run:
        run.advance(seconds)
        run.exchange(version(*after))
        assert [call.target for call in run.calls()] == stopped


def test_inputs_and_events_on_their_way_are_kept() -> None:
    def version(self: Any) -> Automaton:
        color = "red"

        def set_inputs(values: Any) -> None:
            nonlocal color
            color = values["color"]

        def code() -> None:
            self.color = color

        child = Automaton(
            id=2, name="child", states=(State(id=1, name="a", initial=True, code=code), State(id=2, name="b")),
            transitions=(Transition("", 1, 2, id=1, event="lost"),),
            inputs=(Input(name="color", type=str, default="red"),), set_inputs=set_inputs,
        )  # fmt: skip
        state = State(
            id=1, name="s", initial=True, children=(child,), arguments=lambda: {2: {"color": "blue"}}
        )  # fmt: skip
        return Automaton(id=1, name="walker", states=(state,))

    run = Execution(component(version))
    run.advance(0.15)
    run.send("lost")
    run.exchange(component(version))
    assert run.active == "s/a"
    run.advance(0.1)
    assert run.active == "s/b"
    assert user(run).color == "blue"


def test_outputs_are_kept_while_their_type_stays() -> None:
    taken: list[object] = []

    def version(kind: type, default: object) -> Automaton:
        outputs = Output(name="count", type=int, default=0), Output(name="size", type=kind, default=default)
        child = Automaton(
            id=2, name="child", period=10.0, states=(State(id=1, name="a", initial=True),), outputs=outputs,
            set_outputs=lambda values: None, get_outputs=lambda: {"count": 3, "size": 4},
        )  # fmt: skip
        state = State(
            id=1, name="s", initial=True, children=(child,), results=lambda found: taken.append(dict(found))
        )
        return Automaton(id=1, name="walker", states=(state,))

    run = running(version(int, 0), 0.15)
    reload(run, version(str, ""))  # the next cycle of the child is ten seconds away
    run.advance(0.1)
    assert taken == [{"count": 0, "size": 0}, {"count": 3, "size": 4}, {"count": 3, "size": ""}]


def test_a_forced_transition_fires_after_the_reload_unless_it_is_gone() -> None:
    run = running(timed("follow", "dance"), 0.05)
    run.force("walker", "after follow")
    reload(run, timed("follow", "dance"))
    run.advance(0.1)
    assert run.active == "dance"
    run.force("walker", "after dance")
    reload(run, Automaton(id=1, name="walker", states=timed("follow", "dance").states))
    reload(run, timed("follow", "dance"))
    run.advance(0.1)
    assert run.active == "dance"


def test_the_last_transition_is_kept_unless_it_is_gone() -> None:
    run = running(timed("follow", "dance"), 10.05)
    walker = run.automaton("walker")
    reload(run, timed("follow", "dance"))
    assert walker.last_transition == 1
    reload(run, Automaton(id=1, name="walker", states=timed("follow", "dance").states))
    assert walker.last_transition == 0
    reload(run, timed("follow", "dance"))
    run.advance(10.0)
    assert walker.last_transition == 2
    reload(run, Automaton(id=1, name="walker", states=(State(id=7, name="rest", initial=True),)))
    assert walker.last_transition == 0


def test_a_ghost_that_restarts_has_not_waited_in_its_state() -> None:
    def version(*states: str, first: int) -> Automaton:
        inner = timed(*states, id=2, name="inner", seconds=1.0)
        renumbered = tuple(replace(each, id=each.id + first) for each in inner.states)
        moved = tuple(
            replace(each, origin=each.origin + first, destination=each.destination + first)
            for each in inner.transitions
        )
        inner = replace(inner, states=renumbered, transitions=moved)
        return timed("here", "away", seconds=1.5, children={"here": inner})

    run = running(version("a", "b", first=0), 2.0)
    assert run.is_ghost("inner")
    reload(run, version("x", "y", first=5))
    run.advance(1.05)  # the outer automaton is back in `here` for 0.05 s
    run.advance(0.9)
    assert run.state("inner") == "x"
    run.advance(0.2)
    assert run.state("inner") == "y"


def test_a_finished_automaton_stays_finished_while_its_state_is_final() -> None:
    def version(*, final: bool) -> Automaton:
        inner = timed("a", "b", id=2, name="inner", seconds=1.0, b={"final": final})
        return timed("here", children={"here": inner})

    run = running(version(final=True), 2.0)
    assert run.automaton("inner").finished
    reload(run, version(final=True))
    assert run.automaton("inner").finished
    reload(run, version(final=False))
    assert not run.automaton("inner").finished
    run.advance(0.1)
    assert run.state("inner") == "a"


def test_a_component_that_has_ended_does_not_continue_in_another_version() -> None:
    run = running(timed("a", "b", seconds=1.0, b={"final": True}), 2.0)
    assert run.finished
    with pytest.raises(ReloadRefusedError, match="the component has ended"):
        reload(run, timed("a", "b"))


def test_a_state_that_gets_an_automaton_wakes_it() -> None:
    run = running(timed("follow", "dance"), 2.0)
    reload(
        run,
        timed(
            "follow", "dance", children={"follow": timed("red", "green", id=2, name="follow", seconds=1.0)}
        ),
    )
    assert run.active == "follow/red"
    run.advance(1.1)
    assert run.active == "follow/green"


def test_entry_code_does_not_run_again_for_a_state_that_is_kept() -> None:
    entered: list[int] = []
    version = timed("follow", "dance", follow={"entry": lambda: entered.append(1)})
    run = running(version, 2.0)
    assert entered == [1]
    reload(run, version)
    run.advance(1.0)
    assert entered == [1]


def test_the_changes_report_only_what_changed() -> None:
    run = running(timed("follow", "dance"), 2.0)
    seen = len(run.trace)
    reload(run, timed("follow", "dance", children={"dance": timed("a", "b", id=2, name="x")}))
    assert run.trace[seen:] == []
    reload(run, timed("follow", "dance", children={"follow": timed("a", "b", id=2, name="x")}))
    assert [(c.automaton, c.state, c.kind) for c in run.trace[seen:]] == [("x", "a", ChangeKind.ENTERED)]
