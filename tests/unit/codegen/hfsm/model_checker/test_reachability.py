"""What the model checker reports as possible and impossible, by reason."""

from __future__ import annotations

from codegen.hfsm.document import Document, Event, Text
from codegen.hfsm.model_checker import ModelReport, Reachability, WhyNever, check_model
from tests.support.model_documents import PATH, after, automaton, document, finished, on, state, when


def check(doc: Document, limit: int = 100_000) -> ModelReport:
    return check_model(doc, PATH, limit=limit)


def never(report: ModelReport) -> dict[tuple[int, int], WhyNever]:
    """Return the transitions that never fire, with the reason."""
    return {
        (result.automaton, result.transition): result.why
        for result in report.transitions
        if result.reachability is Reachability.IMPOSSIBLE
    }


def entered(report: ModelReport, automaton: int) -> set[int]:
    return {
        result.state
        for result in report.states
        if result.automaton == automaton and result.reachability is Reachability.POSSIBLE
    }


def three(*transitions: object, **others: object) -> Document:
    return document(automaton(1, [state(1), state(2), state(3)], transitions, **others))  # type: ignore[arg-type]


def test_a_shorter_timer_wins() -> None:
    report = check(three(after(500, 1, 2, id=1), after(900, 1, 3, id=2)))
    assert never(report) == {(1, 2): WhyNever.EARLIER}
    assert report.transitions[1].earlier == (1,)
    assert entered(report, 1) == {1, 2}


def test_a_shorter_timer_with_a_guard_does_not_win() -> None:
    assert not never(check(three(after(500, 1, 2, "g", id=1), after(900, 1, 3, id=2))))


def test_of_timers_that_are_over_in_one_cycle_the_first_in_order_wins() -> None:
    transitions = (after(930, 1, 3, id=2), after(910, 1, 2, id=1))
    assert never(check(three(*transitions))) == {(1, 1): WhyNever.EARLIER}
    assert never(check(three(*reversed(transitions)))) == {(1, 2): WhyNever.EARLIER}
    assert never(check(three(*transitions, period=15))) == {(1, 2): WhyNever.EARLIER}


def test_priority_decides_the_order() -> None:
    report = check(three(when("True", 1, 2, id=1), when("g", 1, 3, id=2, priority=1)))
    assert not never(report)
    assert never(check(three(when("True", 1, 2, id=1), when("g", 1, 3, id=2)))) == {(1, 2): WhyNever.EARLIER}


def test_equal_and_opposite_guards_decide_together() -> None:
    transitions = when("g", 1, 2, id=1), when("not g", 1, 1, id=2), when("h", 1, 3, id=3)
    report = check(three(*transitions))
    assert never(report) == {(1, 3): WhyNever.EARLIER}
    assert report.transitions[2].earlier == (1, 2)
    assert never(check(three(when("g", 1, 2, id=1), when("g", 1, 3, id=2)))) == {(1, 2): WhyNever.EARLIER}
    assert not never(check(three(when("next(x)", 1, 2, id=1), when("next(x)", 1, 3, id=2))))


def test_guards_that_read_like_what_events_need_are_others() -> None:
    variables = Text("x, go, event = (0,), 0, None")
    by_data = [when("pass\nreturn x [go]", 1, 2, id=1), on("go", 1, 3, "pass\nreturn x", id=2)]
    by_name = [when("event is None", 1, 2, id=1), on("is None", 1, 3, id=2)]
    for ways, event in ((by_data, "go"), (by_name, "is None")):
        root = automaton(1, [state(1), state(2), state(3)], ways, variables=variables)
        assert not never(check(document(root, events=(Event(name=event),))))


def test_a_guard_that_is_always_false_never_fires() -> None:
    assert never(check(three(when("False", 1, 2, id=1), when("g", 1, 3, id=2)))) == {(1, 1): WhyNever.GUARD}


def test_in_the_first_cycle_no_time_is_over_yet() -> None:
    report = check(three(after(50, 1, 3, id=2, priority=1), when("True", 1, 2, id=1)))
    assert never(report) == {(1, 2): WhyNever.EARLIER}
    back = three(after(50, 1, 3, id=2, priority=1), when("True", 1, 2, id=1), when("g", 2, 1, id=3))
    assert not never(check(back)), "a cycle comes at the earliest 100 ms after a transition"


def test_an_event_comes_when_somebody_sends_it() -> None:
    waits = on("go", 1, 2, id=1)
    assert never(check(three(waits))) == {(1, 1): WhyNever.EVENT}
    outside = document(automaton(1, [state(1), state(2)], [waits]), events=(Event(name="go"),))
    assert not never(check(outside))
    sends = document(automaton(1, [state(1, code='self.send("go")'), state(2)], [waits]))
    assert not never(check(sends))
    another = document(automaton(1, [state(1, code='self.send(" go ")'), state(2)], [waits]))
    assert never(check(another)) == {(1, 1): WhyNever.EVENT}
    any_event = document(automaton(1, [state(1, code="self.send(name)"), state(2)], [waits]))
    assert not never(check(any_event))
    function = document(
        automaton(1, [state(1), state(2)], [waits], functions=Text('def f(self):\n    self.send("go")'))
    )
    assert not never(check(function))


def test_whatever_a_state_asks_for_may_be_refused() -> None:
    assert not never(check(three(on("refused", 1, 2, id=1))))
    guard = "self.Head.stop() or True"  # false where it is refused, and the event comes next
    assert not never(check(three(when(guard, 1, 3, id=1), on("refused", 1, 2, id=2))))
    assert never(check(three(when("n or True", 1, 3, id=1), on("refused", 1, 2, id=2))))
    assert never(check(three(when(guard, 1, 3, id=1), when("x", 1, 2, id=2))))


def test_an_event_that_only_unreachable_code_sends_never_comes() -> None:
    doc = document(automaton(1, [state(1), state(2, code='self.send("go")')], [on("go", 1, 2, id=1)]))
    assert never(check(doc)) == {(1, 1): WhyNever.EVENT}


def below(*transitions: object, ends: bool = True) -> Document:
    """Return a root that waits for its child, which has a second, final state."""
    return document(
        automaton(1, [state(1, children=[2]), state(2)], [finished(1, 2, id=1)]),
        automaton(2, [state(1), state(2, final=ends)], transitions, father=1),  # type: ignore[arg-type]
    )


def test_children_have_to_finish() -> None:
    assert not never(check(below(when("g", 1, 2, id=1))))
    assert never(check(below(when("g", 1, 2, id=1), ends=False))) == {(1, 1): WhyNever.CHILDREN}
    assert (1, 1) in never(check(below()))


def test_all_children_have_to_finish() -> None:
    doc = document(
        automaton(1, [state(1, children=[2, 3]), state(2)], [finished(1, 2, id=1)]),
        automaton(2, [state(1), state(2, final=True)], [after(300, 1, 2, id=1)], father=1),
        automaton(3, [state(1), state(2, final=True)], [when("False", 1, 2, id=1)], father=1),
    )
    assert never(check(doc))[1, 1] is WhyNever.CHILDREN


def test_automata_that_finish_but_are_left_before() -> None:
    doc = document(
        automaton(1, [state(1, children=[2]), state(2)], [finished(1, 2, id=1), after(300, 1, 2, id=2)]),
        automaton(2, [state(1), state(2, final=True)], [after(500, 1, 2, id=1)], father=1),
    )
    assert never(check(doc)) == {(1, 1): WhyNever.ANCESTORS, (2, 1): WhyNever.ANCESTORS}


def stopped(history: str, stay: float = 400, period: float = 100) -> Document:
    """Return an automaton that needs 500 ms below a state that lasts `stay`."""
    return document(
        automaton(
            1,
            [state(1, children=[2], history=history), state(2)],
            [after(stay, 1, 2, id=1), after(200, 2, 1, id=2)],
        ),
        automaton(2, [state(1), state(2)], [after(500, 1, 2, id=1)], father=1, period=period),
    )


def test_a_timer_below_a_state_that_is_left_before_goes_on_when_it_is_resumed() -> None:
    assert not never(check(stopped("")))


def test_a_timer_below_a_state_that_is_left_before_and_restarts_never_fires() -> None:
    assert never(check(stopped("restart"))) == {(2, 1): WhyNever.ANCESTORS}
    assert never(check(stopped("restart", 500))) == {(2, 1): WhyNever.ANCESTORS}, "the one above comes first"
    assert not never(check(stopped("restart", 600)))


def test_cycles_that_do_not_fit_into_those_above_are_followed_exactly() -> None:
    assert never(check(stopped("restart", 500, period=70))) == {(2, 1): WhyNever.ANCESTORS}
    assert not never(check(stopped("restart", 700, period=70)))


def test_a_state_that_is_entered_once_is_left_for_good() -> None:
    doc = document(
        automaton(1, [state(1, children=[2]), state(2)], [after(400, 1, 2, id=1)]),
        automaton(2, [state(1), state(2)], [after(500, 1, 2, id=1)], father=1),
    )
    assert never(check(doc)) == {(2, 1): WhyNever.ANCESTORS}


def visits(entry: str) -> Document:
    """Return an automaton of 130 ms that restarts at 200 ms, 700 ms, ... for 300 ms, and has a timer of 270."""
    return document(
        automaton(
            1, [state(1), state(2, children=[2], history="restart")], [after(200, 1, 2), after(300, 2, 1)]
        ),
        automaton(2, [state(1, entry=entry), state(2)], [after(270, 1, 2, id=1)], father=1, period=130),
    )


def test_timers_start_with_the_entry_code_which_waits_for_a_cycle() -> None:
    assert never(check(visits("pass"))) == {(2, 1): WhyNever.ANCESTORS}


def test_timers_start_at_once_where_there_is_no_entry_code() -> None:
    assert not never(check(visits("")))


def first_cycle(entry: str) -> Document:
    """Return an automaton whose initial state, which owns another, is left in its first cycle."""
    return document(
        automaton(
            1, [state(1, children=[2], history="restart", entry=entry), state(2)], [when("True", 1, 2)]
        ),
        automaton(2, [state(1)], father=1),
    )


def test_an_automaton_that_is_left_before_its_first_cycle_was_active_for_a_moment() -> None:
    assert entered(check(first_cycle("")), 2) == {1}


def test_an_automaton_that_wakes_and_is_left_in_one_cycle_is_never_active() -> None:
    assert entered(check(first_cycle("pass")), 2) == set()


def test_the_first_cycle_comes_at_any_multiple_of_what_the_periods_share() -> None:
    def doc(early: float, late: float) -> Document:
        return document(
            automaton(1, [state(1), state(2, children=[2])], [when("g", 1, 2)]),
            automaton(
                2,
                [state(1), state(2), state(3)],
                [after(late, 1, 2, id=1), after(early, 1, 3, "h", id=2)],
                father=1,
                period=130,
            ),
        )

    assert not never(check(doc(10, 20))), "woken at 900 ms, the first cycle is at 910"
    assert never(check(doc(5, 10))) == {(2, 2): WhyNever.ANCESTORS}


def test_nothing_runs_below_a_final_state() -> None:
    doc = document(
        automaton(1, [state(1), state(2, final=True, children=[2])], [after(300, 1, 2, id=1)]),
        automaton(2, [state(1), state(2)], [after(500, 1, 2, id=1)], father=1),
    )
    assert entered(check(doc), 2) == set()


def test_a_search_that_ends_early_decides_nothing() -> None:
    report = check(stopped("restart", 500, period=70), limit=20)
    assert not report.complete
    assert {r.reachability for r in report.transitions if r.automaton == 2} == {Reachability.UNDECIDED}


def test_documents_that_are_not_finished_are_read_as_they_can_be() -> None:
    for doc in (
        Document(),
        document(automaton(1, [state(1, children=[1, 7])], [when("g", 1, 9), after(5, 8, 1)])),
        document(automaton(1, [state(1)], [on("", 1, 1), when("", 1, 1)], period=-4)),
    ):
        assert check(doc).complete
