"""Which events can arrive: those from outside, and those that code of the document sends."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass, field, replace

from ...diagnostics import Note
from ..analysis import Analysis
from ..code.pieces import is_foreign
from ..document import Text
from ..sends import sends_of, unclear_sends
from .model import AutomatonModel, Model

__all__ = ["Events", "events_of"]


@dataclass(frozen=True)
class Events:
    """The events of a document. Those from `outside` and from functions may arrive at any time.

    Code that cannot be followed may send `unclear` ones.
    """

    all: frozenset[str]
    outside: frozenset[str]
    unclear: frozenset[str] = frozenset()
    analysis: Analysis = field(kw_only=True, repr=False, compare=False)
    places: tuple[Note, ...] = ()
    """Where the code is that cannot be followed."""

    @property
    def certain(self) -> Events:
        """The same without what is unclear."""
        return replace(self, outside=self.outside - self.unclear, unclear=frozenset(), places=())

    def sent_in(
        self, possible: Iterable[tuple[AutomatonModel, Collection[int], Collection[int]]]
    ) -> frozenset[str]:
        """Return the events that may arrive when these states and transitions of automata are possible."""
        sent = set(self.outside)
        for automaton, states, transitions in possible:
            for state in automaton.states:
                if state.index in states:
                    source = state.source
                    values = [argument.value for argument in source.arguments]
                    sent |= self._sent(source.entry, source.code, source.exit, *values)
            for transition in automaton.transitions:
                if transition.index in transitions:
                    sent |= self._sent(transition.source.code)
            if states:  # guards are asked although they do not hold
                sent |= self._sent(
                    *(
                        text
                        for item in automaton.transitions
                        for text in (item.source.guard, item.source.trigger)
                    )
                )
        return frozenset(sent)

    def _sent(self, *texts: Text) -> frozenset[str]:
        return _names(self.analysis, texts)


def _names(analysis: Analysis, texts: Iterable[Text]) -> frozenset[str]:
    """Return the events that code certainly sends."""
    pieces = map(analysis.piece, texts)
    return frozenset[str]().union(*(sends_of(piece.tree).names for piece in pieces if piece is not None))


def events_of(model: Model) -> Events:
    """Return the events that the transitions of a document wait for, and those that come from outside.

    What functions and variables send counts as from outside: they may be called from anywhere. All code
    counts as able to send what cannot be followed, and so does hand-written code beside the document.
    """
    document = model.document
    waited_for = frozenset(
        transition.event
        for automaton in model.automata
        for transition in automaton.transitions
        if transition.event
    )
    declared = frozenset(event.name.strip() for event in document.events)
    analysis = model.analysis
    if is_foreign(document):
        return Events(waited_for, waited_for | declared, analysis=analysis)
    always = [text for automaton in document.automata for text in (automaton.functions, automaton.variables)]
    always += [functions.text for functions in document.functions]
    outside = declared | _names(analysis, always)
    places = tuple(unclear_sends(analysis)) if waited_for - outside else ()
    unclear = waited_for - outside if places else frozenset()
    return Events(waited_for, outside | unclear, unclear, analysis=analysis, places=places)
