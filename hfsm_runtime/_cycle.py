"""The cycle of an automaton: the one function that both drivers, threads and virtual time, run."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Final, Protocol

from greenlet import GreenletExit

from zenoh_ice.data.text import sentence

from ._actor import Actor
from ._automaton import REQUIRED, Arguments, Automaton, Event, State, Transition
from ._phases import BEGUN, ENTERED, ENTERING, PAUSED_AT_CODE, SETTLED, Phase, after_entry_code
from ._variables import convert, functions_of
from .coroutine import current_coroutine
from .errors import ArgumentError, ComponentStoppedError, CycleCutError, ValueTypeError
from .places import locate, place_of_assignment, place_of_result, tell_place
from .tree import Tree


class CycleEnded(Exception):
    """Raised by a supervisor to skip the rest of a cycle; it is no error."""


_ENDS_OF_CYCLES: Final = CycleEnded, CycleCutError, ComponentStoppedError
"""Exceptions that end a cycle and not the component."""


class Supervisor(Protocol):
    """The environment of a cycle."""

    hand_over: float
    """The longest wait in s of wall time for the cycles below a state that is left."""
    halted: bool
    """Whether an error has ended the component: then no code runs any more but exit code of what is left."""

    def now(self) -> int:
        """Return the component time in ns."""

    def heard(self, actor: Actor, error: Exception) -> bool:
        """Return whether a state hears, as an event, that a servant refused what user code asked for."""

    def failed(self, actor: Actor, error: Exception) -> None:
        """Handle another exception of user code; raises CycleEnded to end the cycle."""

    def crashed(self, actor: Actor, error: BaseException) -> None:
        """Handle what ends the component, such as `sys.exit()`; it is raised again."""

    def succeeded(self, actor: Actor) -> None:
        """Handle a cycle that was completed."""

    def left_early(self) -> None:
        """Handle exit code that failed, before its exception, or that does not run as the entry did not end.

        Nobody may stop any more what it would have stopped.
        """

    def skipped(self, actor: Actor, transition: Transition) -> None:
        """Handle the code of a transition that does not run, since exit code before it ended the cycle."""

    def not_handed_over(self, actor: Actor, late: list[Actor]) -> None:
        """Handle automata still in a cycle below a state that `actor` leaves."""


def run_cycle(tree: Tree, actor: Actor, now: int, supervisor: Supervisor) -> None:
    """Run one cycle of an automaton, which belongs to the component time `now`; a ghost runs none.

    First, the entry into the current state is completed, if it is still owed, and the outputs of the automata
    below are taken. Then the transitions out of it are tried, and the first that holds fires: the automata
    below the old state become ghosts and end their running cycles; exit code, change of state, the
    transition's code and entry code follow; then the timers of the new state start and the automata below it
    wake. Finally the code of the current state runs, and the automaton's own outputs are handed up.
    If the entry ends within a period it counts as no time, so that timers keep to the schedule of cycles.
    Cycles that fall due while this one lasts are not made up for.
    """
    if not tree.begin_cycle(actor):
        return
    cycle, observers = actor.cycle, tree.observers
    began = cycle.began = supervisor.now()
    for cycle_began in observers.cycle_began:
        cycle_began(actor, now)
    try:
        _run_steps(tree, actor, now, supervisor)
        supervisor.succeeded(actor)
    except _ENDS_OF_CYCLES:
        pass
    except BaseException as error:
        _report_end(actor, error, supervisor)  # before the cycle ends, so that no other one begins
        raise
    finally:
        if actor.phase is ENTERED:  # a state that is current has begun, whatever ended the cycle
            tree.enter(actor, _settled(actor, now, supervisor))
        cycle.count += 1
        cycle.last = last = time.perf_counter() - cycle.began_wall
        cycle.longest = max(cycle.longest, last)
        lasted = supervisor.now() - began
        if lasted > actor.automaton.interval:
            cycle.overruns += 1
        cycle.last_slot = now
        cycle.began = None
        tree.decide(actor, now + lasted)
        for cycle_ended in observers.cycle_ended:
            cycle_ended(actor, now)
        tree.end_cycle(actor)


def skip_cycle(tree: Tree, actor: Actor, now: int, supervisor: Supervisor) -> bool:
    """Count a cycle in which nothing happens and nobody looks, without running it; false if it has to run."""
    skipped = tree.skip_cycle(actor, now)
    if skipped:
        supervisor.succeeded(actor)
    return skipped


def _run_steps(tree: Tree, actor: Actor, now: int, supervisor: Supervisor) -> None:
    if actor.phase is PAUSED_AT_CODE:
        tree.reach(actor, SETTLED)
    else:
        if actor.outputs.unset:
            actor.outputs.unset = False
            assert actor.automaton.set_outputs is not None
            actor.automaton.set_outputs(actor.automaton.first_outputs())
        if actor.phase < BEGUN:
            _enter(tree, actor, now, supervisor)
        if actor.current.results is not None:
            _take_results(tree, actor, supervisor)
        if actor.phase is not SETTLED and actor.on_duty:
            is_new = actor.phase is BEGUN
            tree.reach(actor, SETTLED)
            if is_new and tree.observers.entered and _pauses(tree, actor, None):
                tree.reach(actor, Phase.PAUSED)
                return
        if not actor.current.final:
            transition = _first_that_holds(tree, actor, now, supervisor)
            if transition is not None and _fire(tree, actor, transition, now, supervisor):
                tree.reach(actor, SETTLED)
                if actor.current.results is not None:
                    _take_results(tree, actor, supervisor)
                if tree.observers.entered and _pauses(tree, actor, transition):
                    tree.reach(actor, PAUSED_AT_CODE)
                    return
    runs_on, state = actor.on_duty, actor.current
    if runs_on and not state.final and state.code is not None:
        tree.decide(actor, now)  # nobody has to wait for the code, but who takes its outputs
        _call(tree, actor, supervisor, state.code)
    if actor.hands_up:
        outputs = _call(tree, actor, supervisor, outputs_of, actor.automaton, _latest_code(actor))
        if isinstance(outputs, dict):
            tree.hand_up(actor, outputs)
    if runs_on and actor.current.final:
        tree.finish(actor, now)  # after the last outputs: who sees the end sees them


def _pauses(tree: Tree, actor: Actor, transition: Transition | None) -> bool:
    """Return whether an observer wants to pause where a state was entered; all of them are notified."""
    pauses = [entered(actor, transition) for entered in tree.observers.entered]
    return any(pauses)


def _first_that_holds(tree: Tree, actor: Actor, now: int, supervisor: Supervisor) -> Transition | None:
    """Return the transition that is to fire, if any: the one that is forced, or the first that holds.

    Transitions are tried with the oldest event. An event that fires none of them is dropped, and those that
    wait for an event are tried with the next one. An event stays first in the queue when another transition
    fires before it, and when the cycle is cut short in between.
    """
    forced = actor.forced
    if forced is not None:
        actor.forced = actor.events.tried = None
        if forced.origin == actor.current.id:
            return forced
    transitions = actor.automaton.exits[actor.current.id].transitions
    while True:
        event = actor.events.tried = tree.next_event(actor, now)
        for transition in transitions:
            if _holds(tree, actor, transition, now, supervisor):
                if event is not None and transition.event:
                    tree.take_event(actor, event, now, handled=True)
                return transition
        if event is None:
            return None
        tree.take_event(actor, event, now, handled=False)
        transitions = tuple(each for each in transitions if each.event)  # the others have been tried


def _holds(tree: Tree, actor: Actor, transition: Transition, now: int, supervisor: Supervisor) -> bool:
    if transition.event:
        event = actor.events.tried
        triggered = event is not None and transition.event == event.name
    elif transition.delay is not None:
        triggered = actor.active_time(now) >= transition.delay
    elif transition.finished:
        triggered = actor.below_finished
    else:
        triggered = True
    guard = transition.guard
    if not triggered or guard is None:
        return triggered
    value = _call(tree, actor, supervisor, _is_true, guard, *_argument(actor, transition)) is True
    actor.guards[transition.id] = value, now
    for guard_evaluated in tree.observers.guard_evaluated:
        guard_evaluated(actor, transition, value, now)
    return value


def _fire(tree: Tree, actor: Actor, transition: Transition, now: int, supervisor: Supervisor) -> bool:
    """Fire a transition; false when the new state is not entered, since the automaton became a ghost."""
    if not tree.leave(actor, now):
        return False
    for fired in tree.observers.fired:
        fired(actor, transition, now)
    try:
        try:
            late = tree.wait_for_cycles(actor, supervisor.hand_over) if actor.below else ()
            if late:
                supervisor.not_handed_over(actor, late)
        finally:
            if actor.current.exit_runs:
                _run_exit_code(tree, actor, supervisor)
    except (CycleEnded, CycleCutError):
        if transition.code is not None:
            supervisor.skipped(actor, transition)
        raise
    finally:  # once the automata below have stopped, the state changes whatever its exit code does
        changed = tree.change(actor, transition, now)
    if not changed:
        return False
    if transition.code is not None:
        _call(tree, actor, supervisor, transition.code, *_argument(actor, transition))
    _enter(tree, actor, now, supervisor)
    return actor.on_duty


def _run_exit_code(tree: Tree, actor: Actor, supervisor: Supervisor) -> None:
    """Run the exit code of all that is left, whatever fails in between; then end the cycle as the first did.

    What ends the component comes before what only ends a cycle.
    """
    ends: list[BaseException] = []
    for left, state in _left_for_good(actor):
        if state.exit is None:
            continue
        try:
            if left.owed:  # it does not run, since the entry is not complete
                supervisor.left_early()
            else:
                _call(tree, left, supervisor, _exit, state.exit, supervisor)
        except BaseException as end:  # noqa: BLE001 - raised below
            ends.append(end)
    if ends:
        ends.sort(key=lambda end: isinstance(end, _ENDS_OF_CYCLES))
        for each in ends:  # all but the first are never seen again
            _report_end(actor, each, supervisor)
        raise ends[0]


def _report_end(actor: Actor, end: BaseException, supervisor: Supervisor) -> None:
    """Report what ends the component; in virtual time Ctrl-C does not, and neither does who drops it."""
    is_of_driver = isinstance(end, KeyboardInterrupt | GreenletExit) and current_coroutine() is not None
    if not (isinstance(end, _ENDS_OF_CYCLES) or is_of_driver):
        supervisor.crashed(actor, end)


def _exit(code: Callable[[], object], supervisor: Supervisor) -> None:
    try:
        code()
    except BaseException:
        supervisor.left_early()
        raise


def _enter(tree: Tree, actor: Actor, now: int, supervisor: Supervisor) -> None:
    """Complete the entry into the current state; a ghost completes it later."""
    state = actor.current
    if not actor.on_duty:
        return
    if actor.phase <= ENTERING:
        if state.entry is not None:  # a reload may have taken it away
            tree.reach(actor, ENTERING)
            _call(tree, actor, supervisor, state.entry)
        tree.reach(actor, after_entry_code(state))
    arguments = state.arguments
    if arguments is not None and actor.phase is Phase.OWES_ARGUMENTS:
        _call(tree, actor, supervisor, lambda: hand_over(state, arguments()))
    tree.enter(actor, _settled(actor, now, supervisor))


def _settled(actor: Actor, now: int, supervisor: Supervisor) -> int:
    """Return the time from which the timers of a state count, now that its entry is complete."""
    ended = supervisor.now()
    assert actor.cycle.began is not None
    return now if ended - actor.cycle.began < actor.automaton.interval else ended


def _left_for_good(actor: Actor) -> list[tuple[Actor, State]]:
    """Return the states that are left for good when an automaton leaves its own, in this order.

    The entry into them has at least begun.
    """
    left: list[tuple[Actor, State]] = []
    if actor.current.restart and actor.phase >= BEGUN:  # if not woken since, they have left already
        for child in actor.below:
            if child.phase >= ENTERING and not child.current.final:
                left += _left_for_good(child)
    left.append((actor, actor.current))
    return left


def _argument(actor: Actor, transition: Transition) -> tuple[Event, ...]:
    """Return what the guard and the code of a transition take: the event if it has one."""
    if not transition.event:
        return ()
    event = actor.events.tried
    if event is None or event.name != transition.event:  # it was forced
        event = Event(transition.event)
    return (event,)


def _is_true(guard: Callable[..., object], *event: Event) -> bool:
    value = guard(*event)
    try:
        return bool(value)
    except Exception as error:  # as of an array with several elements
        place, file = place_of_result(guard)
        if not locate(error, file):
            tell_place(error, place)
        raise


def _call(
    tree: Tree, actor: Actor, supervisor: Supervisor, code: Callable[..., object], *arguments: object
) -> object:
    """Return the result of a piece of user code, or None when it failed and the cycle continues."""
    if supervisor.halted and code is not _exit:  # a thread of user code may have failed meanwhile
        raise ComponentStoppedError
    try:
        return code(*arguments)
    except Exception as error:  # noqa: BLE001 - user code may raise anything; the supervisor reports it
        if supervisor.heard(actor, error):
            return None
        for code_failed in tree.observers.code_failed:
            code_failed(actor, error)
        supervisor.failed(actor, error)
        return None


def _take_results(tree: Tree, actor: Actor, supervisor: Supervisor) -> None:
    """Take the outputs of the automata below the current state into variables."""
    results = actor.current.results
    if results is not None and actor.awake:
        outputs = tree.outputs_below(actor)
        _call(tree, actor, supervisor, results, outputs)


def outputs_of(automaton: Automaton, code: Iterable[Callable[..., object]]) -> dict[str, object]:
    """Return the present outputs of an automaton; raises ValueTypeError for one of another type.

    The error has the place at which the value was most probably assigned: the first of the `code` that does.
    """
    assert automaton.get_outputs is not None
    try:
        values = automaton.get_outputs()
    except NameError as error:  # some code has deleted one
        tell_place(error, place_of_assignment(code, error.name or ""))
        raise
    outputs: dict[str, object] = {}
    for declared in automaton.outputs:
        what = sentence(f"the output {declared.name!r} of automaton {automaton.id} ({automaton.name!r})")
        try:
            outputs[declared.name] = convert(values[declared.name], declared.type, what)
        except ValueTypeError as error:
            tell_place(error, place_of_assignment(code, declared.name))
            raise
    return outputs


def _latest_code(actor: Actor) -> Iterator[Callable[..., object]]:
    """Yield the code of an automaton, beginning with what ran last."""
    state, automaton = actor.current, actor.automaton
    fired = (each.code for each in automaton.transitions if each.id == actor.last_transition)
    yield from (code for code in (state.code, state.entry, *fired) if code is not None)
    yield from functions_of(automaton)


def hand_over(state: State, arguments: Arguments) -> None:
    """Set the inputs of a state's automata; those without an argument keep their value.

    Nothing is set when one of them cannot be: raises ArgumentError, and ValueTypeError for a value of another
    type.
    """
    by_child = _by_child(state, arguments)
    unknown = by_child.keys() - {child.id for child in state.children}
    if unknown:
        raise ArgumentError(f"the state {state.name!r} owns no automaton {min(unknown)}")
    checked = [(child, _check(state, child, by_child.get(child.id, {}))) for child in state.children]
    for child, values in checked:
        if values and child.set_inputs is not None:
            child.set_inputs(values)


def _by_child(state: State, arguments: Arguments) -> dict[int, Mapping[str, object]]:
    values: dict[str, object] = {}
    found: dict[int, Mapping[str, object]] = {}
    for key, value in arguments.items():
        if isinstance(key, str):
            values[key] = value
        else:
            assert isinstance(value, Mapping)
            found[key] = value
    if values:
        if len(state.children) != 1:
            raise ArgumentError(f"the state {state.name!r} does not own one automaton: say which by its id")
        found[state.children[0].id] = values
    return found


def _check(state: State, child: Automaton, values: Mapping[str, object]) -> dict[str, object]:
    inputs = {declared.name: declared for declared in child.inputs}
    label = f"automaton {child.id} ({child.name!r}) of the state {state.name!r}"
    for name in values:
        if name not in inputs:
            raise ArgumentError(f"{label} has no input {name!r}: it has {', '.join(inputs) or 'none'}")
    for declared in child.inputs:
        if declared.default is REQUIRED and declared.name not in values:
            raise ArgumentError(f"{label} is not handed its input {declared.name!r}, which has no default")
    return {
        name: convert(value, inputs[name].type, f"the input {name!r} of {label}")
        for name, value in values.items()
    }
