"""What tests have covered: counted while behaviors run, carried between processes, added up."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hfsm_runtime import Transition
from hfsm_runtime.observer import Watcher
from hfsm_runtime.tree import ChangeKind, Run, Tree

__all__ = ["AutomatonHits", "Hits"]


@dataclass(slots=True)
class AutomatonHits:
    """How often something happened in one automaton, by the ids of its states and transitions."""

    states: dict[int, int] = field(default_factory=dict)
    """Entries into a state."""
    transitions: dict[int, int] = field(default_factory=dict)
    """How often a transition fired."""
    true: dict[int, int] = field(default_factory=dict)
    """How often the guard of a transition held."""
    false: dict[int, int] = field(default_factory=dict)
    """How often it did not."""


class Hits:
    """Counts by document, which is its absolute path, and by the id of the automaton."""

    def __init__(self) -> None:
        self._counts: dict[str, dict[int, AutomatonHits]] = {}

    def of(self, document: str, automaton: int) -> AutomatonHits:
        """Return the counts of an automaton, all 0 when it never ran."""
        return self._counts.setdefault(document, {}).setdefault(automaton, AutomatonHits())

    def watch(self, document: Callable[[], Path | None], tree: Tree) -> None:
        """Count what automata do from now on; where they are now counts as entered.

        `document` returns the file of which they are, which changes when it is reloaded.
        """
        counter = _Counter(self, document)
        for run in tree.runs:
            if run.active:
                counter.changed(0, run, ChangeKind.ENTERED)
        tree.observers.append(counter)

    def to_json(self) -> dict[str, Any]:
        """Return the counts as plain values."""
        return {
            document: {
                str(automaton): {name: getattr(hits, name) for name in AutomatonHits.__slots__}
                for automaton, hits in automata.items()
            }
            for document, automata in self._counts.items()
        }

    def add_json(self, counts: dict[str, Any]) -> None:
        """Add what `to_json` returned in another process."""
        for document, automata in counts.items():
            for automaton, fields in automata.items():
                mine = self.of(document, int(automaton))
                for name, numbers in fields.items():
                    target: dict[int, int] = getattr(mine, name)
                    for key, number in numbers.items():
                        target[int(key)] = target.get(int(key), 0) + number


class _Counter(Watcher):
    def __init__(self, hits: Hits, document: Callable[[], Path | None]) -> None:
        self._hits = hits
        self._document = document

    def guard_evaluated(self, run: Run, transition: Transition, value: bool, at: int) -> None:  # noqa: ARG002
        hits = self._of(run)
        _count(hits.true if value else hits.false, transition.id)

    def fired(self, run: Run, transition: Transition, at: int) -> None:  # noqa: ARG002
        _count(self._of(run).transitions, transition.id)

    def changed(self, now: int, run: Run, kind: ChangeKind) -> None:  # noqa: ARG002
        if kind is ChangeKind.ENTERED:
            _count(self._of(run).states, run.current.id)

    def _of(self, run: Run) -> AutomatonHits:
        return self._hits.of(str((self._document() or Path()).resolve()), run.automaton.id)


def _count(numbers: dict[int, int], id: int) -> None:
    numbers[id] = numbers.get(id, 0) + 1
