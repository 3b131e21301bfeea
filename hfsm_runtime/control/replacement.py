"""Another version of a component that is ready to take the place of the one that runs."""

from __future__ import annotations

from collections.abc import Mapping

from ..component import Component, make_automata
from ..tree import Replaced, Run, Tree, grow
from .carrying import FirstValues, carry_variables, first_values, share_attributes

__all__ = ["Replacement", "first_values_of"]


def first_values_of(runs: tuple[Run, ...]) -> Mapping[int, FirstValues]:
    """Return what the variables of automata begin with, by the automaton's id; call it before they run."""
    return {run.automaton.id: first_values(run.automaton) for run in runs}


class Replacement:
    """A component with its automata, made while the former version still runs.

    Making it runs the variables of the document; raises what `make_automata` does, and DefinitionError.
    `not_kept` says what the new version could not keep, for people; it is complete after `apply`.
    """

    def __init__(self, component: Component, not_kept: tuple[str, ...] = ()) -> None:
        self.component = component
        self.runs = grow(make_automata(component))
        self.first = first_values_of(self.runs)
        self.not_kept = not_kept

    def apply(self, tree: Tree, former: Component, first: Mapping[int, FirstValues], now: int) -> Replaced:
        """Take the place of the former version, under the lock of the tree and while no cycle runs.

        `first` is what the variables of the former version began with.
        """
        told = []
        for new in self.runs:
            old = tree.run(new.automaton.id)
            if old is not None:
                known = first.get(new.automaton.id, {})
                lost = carry_variables(old.automaton, new.automaton, known)
                if lost:
                    told.append(f"variables of {_label(new)} are gone: {', '.join(lost)}")
        share_attributes(former, self.component)
        began = {run for run in tree.runs if run.entered is not None}
        replaced = tree.replace(self.runs, now)
        for run in replaced.gone:
            where = f", which was in {run.current.name}" if run in began else ""
            code = "; its exit code did not run" if run in began and run.current.exit is not None else ""
            told.append(f"{_label(run)} is gone{where}{code}")
        for run, left in replaced.displaced:
            code = "; its exit code did not run" if left.exit is not None else ""
            told.append(
                f"{_label(run)} was in the state {left.name}, which is gone, "
                f"and begins anew in {run.automaton.initial.name}{code}"
            )
        self.not_kept = (*self.not_kept, *told)
        return replaced


def _label(run: Run) -> str:
    return f"automaton {run.automaton.id} ({run.automaton.name})"
