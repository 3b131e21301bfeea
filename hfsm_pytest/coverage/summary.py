"""Coverage put together: what there is against what was hit."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .hits import AutomatonHits, Hits
from .inventory import AutomatonItems, DocumentItems, StateItem, TransitionItem

__all__ = ["AutomatonCoverage", "DocumentCoverage", "Missing", "Ratio", "Summary"]


@dataclass(frozen=True, slots=True)
class Ratio:
    """So many of so many."""

    hit: int = 0
    total: int = 0

    def __add__(self, other: Ratio) -> Ratio:
        return Ratio(self.hit + other.hit, self.total + other.total)

    def __str__(self) -> str:
        return f"{self.hit}/{self.total}" if self.total else "-"

    @property
    def percent(self) -> float:
        """The share in percent, 100 of nothing."""
        return 100.0 * self.hit / self.total if self.total else 100.0


@dataclass(frozen=True, slots=True)
class Missing:
    """What no test has done, and where it is written."""

    what: str
    file: str
    line: int

    def __str__(self) -> str:
        return f"{self.file}:{self.line}: {self.what}"


@dataclass(frozen=True, slots=True)
class AutomatonCoverage:
    """An automaton with its counts."""

    items: AutomatonItems
    hits: AutomatonHits

    @property
    def states(self) -> Ratio:
        """States that were entered."""
        return Ratio(sum(self.entered(state) > 0 for state in self.items.states), len(self.items.states))

    @property
    def transitions(self) -> Ratio:
        """Transitions that fired."""
        transitions = self.items.transitions
        return Ratio(sum(self.times_fired(each) > 0 for each in transitions), len(transitions))

    @property
    def guards(self) -> Ratio:
        """Values that guards have had: two are to be had of each."""
        guarded = [each for each in self.items.transitions if each.guarded]
        return Ratio(sum(value > 0 for each in guarded for value in self.guard(each)), 2 * len(guarded))

    @property
    def all(self) -> Ratio:
        """Everything together."""
        return self.states + self.transitions + self.guards

    def entered(self, state: StateItem) -> int:
        """Return how often a state was entered."""
        return self.hits.states.get(state.id, 0)

    def times_fired(self, transition: TransitionItem) -> int:
        """Return how often a transition fired."""
        return self.hits.transitions.get(transition.id, 0)

    def guard(self, transition: TransitionItem) -> tuple[int, int]:
        """Return how often the guard of a transition held, and how often it did not."""
        return self.hits.true.get(transition.id, 0), self.hits.false.get(transition.id, 0)

    def missing(self) -> Iterator[Missing]:
        """Yield what is missing, by line."""
        found = [*self._missing_states(), *self._missing_transitions()]
        yield from sorted(found, key=lambda missing: missing.line)

    def _missing_states(self) -> Iterator[Missing]:
        for state in self.items.states:
            if not self.entered(state):
                what = f"state {self.items.name}/{state.name} was never entered"
                yield Missing(what, self.items.file, state.line)

    def _missing_transitions(self) -> Iterator[Missing]:
        for each in self.items.transitions:
            way = f"{self.items.state(each.origin)} -> {self.items.state(each.destination)}"
            what = f"transition {each.name} of {self.items.name} ({way})"
            held, held_not = self.guard(each)
            problems = [] if self.times_fired(each) else ["never fired"]
            if each.guarded and not (held or held_not):
                problems.append("its guard was never asked")
            elif each.guarded and not (held and held_not):
                problems.append(f"its guard was never {'false' if held else 'true'}")
            if problems:
                yield Missing(f"{what}: {', '.join(problems)}", self.items.file, each.line)


@dataclass(frozen=True, slots=True)
class DocumentCoverage:
    """A document with the coverage of its automata."""

    file: str
    automata: tuple[AutomatonCoverage, ...]

    @property
    def states(self) -> Ratio:
        """States that were entered."""
        return sum((each.states for each in self.automata), Ratio())

    @property
    def transitions(self) -> Ratio:
        """Transitions that fired."""
        return sum((each.transitions for each in self.automata), Ratio())

    @property
    def guards(self) -> Ratio:
        """Values that guards have had."""
        return sum((each.guards for each in self.automata), Ratio())

    @property
    def all(self) -> Ratio:
        """Everything together."""
        return self.states + self.transitions + self.guards

    def missing(self) -> list[Missing]:
        """Return what is missing."""
        return [missing for each in self.automata for missing in each.missing()]


@dataclass(frozen=True, slots=True)
class Summary:
    """The coverage of all documents."""

    documents: tuple[DocumentCoverage, ...]

    @classmethod
    def of(cls, documents: Sequence[DocumentItems], hits: Hits, root: Path) -> Summary:
        """Put what there is and what was hit together."""
        return cls(
            tuple(
                DocumentCoverage(
                    document.file,
                    tuple(
                        AutomatonCoverage(each, hits.of(str((root / document.file).resolve()), each.id))
                        for each in document.automata
                    ),
                )
                for document in documents
            )
        )

    @property
    def all(self) -> Ratio:
        """Everything together."""
        return sum((document.all for document in self.documents), Ratio())

    def to_json(self) -> dict[str, Any]:
        """Return the summary as plain values."""
        return {
            "percent": round(self.all.percent, 2),
            "documents": [
                {
                    "file": document.file,
                    "percent": round(document.all.percent, 2),
                    "missing": [str(missing) for missing in document.missing()],
                    "automata": [_automaton_json(each) for each in document.automata],
                }
                for document in self.documents
            ],
        }


def _automaton_json(automaton: AutomatonCoverage) -> dict[str, Any]:
    items = automaton.items
    return {
        "id": items.id,
        "name": items.name,
        "file": items.file,
        "states": [
            {"id": state.id, "name": state.name, "line": state.line, "entered": automaton.entered(state)}
            for state in items.states
        ],
        "transitions": [
            {
                "id": each.id,
                "name": each.name,
                "line": each.line,
                "fired": automaton.times_fired(each),
                "guard": dict(zip(("true", "false"), automaton.guard(each), strict=True))
                if each.guarded
                else None,
            }
            for each in items.transitions
        ],
    }
