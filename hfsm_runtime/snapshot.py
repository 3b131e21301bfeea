"""What a component is and does, in the words of `interfaces/hfsm.idl`."""

from __future__ import annotations

from typing import Final

from interfaces.hfsm import (
    AutomatonSnapshot,
    AutomatonStructure,
    ComponentSnapshot,
    ComponentStatus,
    ComponentStructure,
    ErrorReport,
    GuardSnapshot,
    StateStructure,
    TimerSnapshot,
    TransitionStructure,
)

from .runtime import Runtime, Status
from .tree import Run
from .variables import variables_of

__all__ = ["structure_of", "take_snapshot"]

_STATUS: Final = {
    Status.RUNNING: ComponentStatus.Running,
    Status.PAUSED: ComponentStatus.Paused,
    Status.HALTED: ComponentStatus.Halted,
}


def structure_of(runtime: Runtime) -> ComponentStructure:
    """Return the automata of a component, the root first, each before its children."""
    return ComponentStructure(name=runtime.name, automata=[_structure(run) for run in runtime.tree.runs])


def take_snapshot(runtime: Runtime) -> ComponentSnapshot:
    """Return what a component is doing."""
    with runtime.tree.lock:
        now = runtime.timeline.now()
        automata = [_snapshot(run, now) for run in runtime.tree.runs]
    for run, snapshot in zip(runtime.tree.runs, automata, strict=True):
        snapshot.variables = variables_of(run.automaton)  # user code, so without the lock
    return ComponentSnapshot(
        time=now / 1e9,
        status=_STATUS[runtime.status],
        automata=automata,
        errors=[
            ErrorReport(
                time=record.time / 1e9,
                automaton=record.automaton,
                state=record.state,
                location=record.location,
                message=record.message,
            )
            for record in runtime.errors
        ],
    )


def _structure(run: Run) -> AutomatonStructure:
    automaton = run.automaton
    return AutomatonStructure(
        id=automaton.id,
        name=automaton.name,
        parent=run.parent.automaton.id if run.parent else 0,
        owner=run.owner.id if run.owner else 0,
        period=automaton.period,
        states=[
            StateStructure(
                id=state.id,
                name=state.name,
                initial=state.initial,
                child=state.children[0].id if state.children else 0,
            )
            for state in automaton.states
        ],
        transitions=[
            TransitionStructure(
                id=transition.id,
                name=transition.name,
                origin=transition.origin,
                destination=transition.destination,
                timed=transition.seconds is not None,
                seconds=transition.seconds or 0.0,
                condition=transition.condition,
            )
            for transition in automaton.transitions
        ],
    )


def _snapshot(run: Run, now: int) -> AutomatonSnapshot:
    waited = run.active_time(now)
    return AutomatonSnapshot(
        id=run.automaton.id,
        state=run.current.id,
        ghost=run.parent is not None and not run.active,  # the root is none, not even before it starts
        lastTransition=run.last_transition,
        enteredAt=(run.entered or 0) / 1e9,
        timers=[
            TimerSnapshot(transition=transition.id, remaining=max(0, transition.delay - waited) / 1e9)
            for transition in run.automaton.outgoing(run.current)
            if transition.delay is not None
        ],
        guards=[GuardSnapshot(transition=key, value=value) for key, value in dict(run.guards).items()],
        variables={},
        cycles=run.cycles,
        overruns=run.overruns,
        lastCycle=run.last_cycle,
        longestCycle=run.longest_cycle,
    )
