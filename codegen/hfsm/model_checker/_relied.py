"""Say what the proofs about a document rely on; its component keeps it, and the runtime looks."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Iterator

from ... import logic
from .._effects import CodeEffects
from ..document import Text
from ._checker import QUICK_LIMIT, ModelReport, check_model
from ._exploration import Budget
from ._fireability import Fireability, events_of, fireability_of, sent_by
from .expressions import parse
from .model import EVENT, AutomatonModel, Model, StateModel, nanoseconds, read_model
from .properties import PropertyResult, Verdict, check_property
from .transition_system import TransitionSystem


def relied_on(effects: CodeEffects) -> tuple[list[logic.Row], ModelReport | None]:
    """Return what proofs rely on, and the report of a quick check if the document states properties.

    There is none where neither code nor guards decide what automata can do, and nothing is stated.
    """
    document, path = effects.analysis.document, effects.analysis.path
    model = read_model(document, path, effects=effects)
    events = events_of(model)
    waited_for = {each.event for one in model.automata for each in one.transitions if each.event}
    inner = frozenset() if events.unclear else waited_for - events.outside
    relied: list[logic.Relied] = [*_sent(model, inner), *_guards(model)]
    if not relied and not document.properties:
        return [], None
    untimed = fireability_of(
        read_model(document, path, effects=effects, untimed=True), events.outside | events.unclear
    )
    relied += _never(untimed)
    report = check_model(document, path, limit=QUICK_LIMIT, effects=effects) if document.properties else None
    relied += _proved(report.properties if report else (), model, untimed)
    return [logic.to_row(each) for each in relied], report


def _proved(
    results: Iterable[PropertyResult], model: Model, untimed: Fireability
) -> Iterator[logic.Property]:
    for result in results:
        if result.verdict is Verdict.HOLDS:
            stated = result.property
            name = " ".join((stated.name or stated.expression.text).split())
            expression = parse(stated.expression.text, model)
            cone = TransitionSystem(expression.automata or {0}, untimed).cone
            decided_by = tuple(model.automata[index].source.id for index in cone)
            is_timed = check_property(stated, untimed, Budget(QUICK_LIMIT)).verdict is not Verdict.HOLDS
            within, form = nanoseconds(stated.within) or 0, _by_ids(expression.form, model)
            yield logic.Property(name, stated.kind.strip(), within, is_timed, decided_by, form)


def _never(untimed: Fireability) -> Iterator[logic.Unentered | logic.Unfired]:
    """Yield the states and transitions that are impossible, of all that is not below such a state."""
    for automaton in untimed.model.automata:
        possible, transitions = untimed.states[automaton.index], untimed.transitions[automaton.index]
        for state in automaton.states if possible else ():
            if state.index not in possible:
                yield logic.Unentered(automaton.source.id, state.source.id)
                continue
            for each in state.outgoing:
                if each.index not in transitions:
                    yield logic.Unfired(automaton.source.id, each.source.id)


def _sent(model: Model, events: Collection[str]) -> Iterator[logic.Sent]:
    states = {event: list[tuple[int, int]]() for event in sorted(events)}
    for automaton in model.automata if events else ():
        for state in automaton.states:
            for event in sent_by(model.effects, _running_in(model, automaton, state)).intersection(events):
                states[event].append((automaton.source.id, state.source.id))
    for event, senders in states.items():
        yield logic.Sent(event, tuple(senders))


def _running_in(model: Model, automaton: AutomatonModel, state: StateModel) -> Iterator[Text]:
    """Yield the code that runs in the cycles of an automaton while a state is the current one."""
    yield from (state.source.entry, state.source.code)
    yield from (argument.value for argument in state.source.arguments)
    for transition in automaton.transitions:
        if transition.origin == state.index:
            yield from (transition.source.guard, transition.source.trigger)
        if transition.target == state.index:
            yield transition.source.code
    yield from _exits(model, state)


def _exits(model: Model, state: StateModel) -> Iterator[Text]:
    """Yield the code that runs when a state is left, with that of all states below."""
    yield state.source.exit
    for child in state.children:
        for below in model.automata[child].states:
            yield from _exits(model, below)


def _guards(model: Model) -> Iterator[logic.Guard | logic.Link]:
    """Yield the guards that decide together which of them hold."""
    for automaton in model.automata:
        for state in automaton.states:
            literals = [
                (each, [literal for literal in each.needs if literal[0] != f"{EVENT}{each.event}"])
                for each in state.outgoing
                if each.guarded and each.needs
            ]
            uses = Counter(atom for each, _ in literals for atom in each.atoms)
            for each, _ in literals:
                del uses[f"{EVENT}{each.event}"]
            ids = automaton.source.id, state.source.id
            linked = dict[logic.Conjunction, None]()
            for each, needs in literals:
                if any(uses[atom] > 1 for atom in each.atoms):
                    yield logic.Guard(*ids, each.source.id, tuple(needs))
                    linked |= dict.fromkeys(each.links)
            for link in linked:
                yield logic.Link(*ids, link)


def _by_ids(form: logic.Form, model: Model) -> logic.Form:
    """Return an expression by the ids of automata and states."""
    kind, *parts = form
    if kind == "in":
        automata = model.automata
        return kind, *((automata[a].source.id, automata[a].states[s].source.id) for a, s in parts)
    return kind, *(
        model.automata[each].source.id if isinstance(each, int) else _by_ids(each, model) for each in parts
    )
