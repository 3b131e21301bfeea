"""Structure and state of a component, in the types of `interfaces/hfsm.idl`."""

from __future__ import annotations

from typing import Final

from interfaces import hfsm

from .._automaton import Transition
from .._component_run import ComponentRun
from .._variables import short_repr, variables_of
from ..component import parameter_values, parameters_of
from ..tree import Actor
from ._breakpoints import Breakpoints

_MOST_ERRORS: Final = 20  # as the interface says


def structure_of(runtime: ComponentRun) -> hfsm.ComponentStructure:
    """Return the automata of a component, the root first, each before its children."""
    return hfsm.ComponentStructure(
        name=runtime.name,
        document=runtime.component._hfsm_document,
        generation=runtime.reloads,
        parameters=[
            hfsm.ParameterStructure(name=name, type=type(p.default).__name__, description=p.description)
            for name, p in parameters_of(runtime.component).items()
        ],
        automata=[_structure(actor) for actor in runtime.tree.actors],
        events=sorted(runtime.component._hfsm_events),
    )


def take_snapshot(
    runtime: ComponentRun, started_at: float, points: Breakpoints | None = None
) -> hfsm.ComponentSnapshot:
    """Return a snapshot of a component; `started_at` is its start as a wall time in s since the epoch."""
    with runtime.tree.lock:
        now, reloads = runtime.component_time.now(), runtime.reloads
        automata = [(actor.automaton, _snapshot(actor, now)) for actor in runtime.tree.actors]
        for actor, (_, snapshot) in zip(runtime.tree.actors, automata, strict=True):
            snapshot.hangsFor, snapshot.hangsAt = runtime.hanging(actor)
    for automaton, snapshot in automata:
        snapshot.variables = variables_of(automaton)  # user code, so without the lock
    return hfsm.ComponentSnapshot(
        startedAt=started_at,
        time=now / 1e9,
        status=runtime.status,
        generation=reloads,
        automata=[snapshot for _, snapshot in automata],
        parameters={name: short_repr(value) for name, value in parameter_values(runtime.component).items()},
        stoppedAt=list(points.stopped_at) if points else [],
        errors=list(runtime.errors[-_MOST_ERRORS:]),
        marks=[hfsm.Mark(*mark) for mark in runtime.marks.shown(now)],
        refusal=refusal.message if (refusal := runtime.refusal) is not None else "",
        speed=runtime.speed,
        joints=runtime.joints(),
    )


def _structure(actor: Actor) -> hfsm.AutomatonStructure:
    automaton = actor.automaton
    return hfsm.AutomatonStructure(
        id=automaton.id,
        name=automaton.name,
        parent=actor.parent.automaton.id if actor.parent else 0,
        owner=actor.owner.id if actor.owner else 0,
        period=automaton.period,
        source=automaton.source,
        states=[
            hfsm.StateStructure(
                id=state.id,
                name=state.name,
                initial=state.initial,
                final=state.final,
                children=[child.id for child in state.children],
                restart=state.restart,
            )
            for state in automaton.states
        ],
        transitions=[
            hfsm.TransitionStructure(
                id=transition.id,
                name=transition.name,
                origin=transition.origin,
                destination=transition.destination,
                kind=_kind(transition),
                seconds=transition.seconds or 0.0,
                event=transition.event,
                condition=transition.condition,
                order=automaton.outgoing(automaton.state(transition.origin)).index(transition) + 1,
            )
            for transition in automaton.transitions
        ],
    )


def _kind(transition: Transition) -> hfsm.TransitionKind:
    if transition.seconds is not None:
        return hfsm.TransitionKind.OnTime
    if transition.event:
        return hfsm.TransitionKind.OnEvent
    return hfsm.TransitionKind.OnFinished if transition.finished else hfsm.TransitionKind.OnCondition


def _snapshot(actor: Actor, now: int) -> hfsm.AutomatonSnapshot:
    waited = actor.active_time(now)
    return hfsm.AutomatonSnapshot(
        id=actor.automaton.id,
        state=actor.current.id,
        ghost=actor.parent is not None and not actor.active,  # the root is none, not even before it starts
        finished=actor.finished,
        lastTransition=actor.last_transition,
        enteredAt=actor.entered / 1e9,
        timers=[
            hfsm.TimerSnapshot(transition=transition.id, remaining=max(0, transition.delay - waited) / 1e9)
            for transition in actor.automaton.outgoing(actor.current)
            if transition.delay is not None
        ],
        guards=[
            hfsm.GuardSnapshot(transition=key, value=value) for key, (value, _) in dict(actor.guards).items()
        ],
        variables={},
        cycles=actor.cycle.count,
        overruns=actor.cycle.overruns,
        lastCycle=actor.cycle.last,
        longestCycle=actor.cycle.longest,
        inCycle=actor.in_cycle,
    )
