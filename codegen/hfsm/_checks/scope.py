"""Find out whose variable a name is that an automaton itself does not have.

The code of an automaton shares its variables with no other automaton. People expect otherwise, above all of
the automata above.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from ...diagnostics import Location, Note
from ...messages import Message
from ..analysis import Analysis, AutomatonCode
from ..codes import Code
from ..report import Report, state_label


@dataclass(eq=False)
class Above:
    """The variables of the automata above one."""

    analysis: Analysis
    automaton: AutomatonCode

    @cached_property
    def _owners(self) -> Mapping[str, AutomatonCode]:
        found: dict[str, AutomatonCode] = {}
        by_id = {code.automaton.id: code for code in reversed(self.analysis.automata)}
        for above in self.analysis.document.above(self.automaton.automaton):
            for name in by_id[above.id].names:
                found.setdefault(name, by_id[above.id])
        return found

    def report(self, name: str, place: Location, report: Report) -> bool:
        """Report a use of a variable of an automaton above; return false if none of them has it."""
        owner = self._owners.get(name)
        if owner is None:
            return False
        message = Message(
            "`{name}` is a variable of {automaton}, and each automaton has its own",
            name=name,
            automaton=self._label(owner),
        )
        own = self._label(self.automaton)
        is_read_only = all(name not in piece.bound for piece in self.automaton.sharing())
        advice = Message(
            "make it an output of {automaton}, or write `self.{name}` in both", automaton=own, name=name
        )
        if is_read_only:
            advice = Message(
                "pass it to {automaton} as an input, or write `self.{name}` in both", automaton=own, name=name
            )
        notes = [Note(advice)]
        stores = (piece.place_of_store(name) for piece in owner.sharing())
        if (given := next(filter(None, stores), None)) is not None:
            notes.insert(0, Note(Message("it gets its value here"), given))
        # By the code the editor knows which fix to offer.
        code = Code.VARIABLE_ABOVE if is_read_only else Code.ASSIGNED_VARIABLE_ABOVE
        report.warning(code, message, place, notes)
        return True

    def _label(self, code: AutomatonCode) -> Message:
        state = self.analysis.document.owner(code.automaton)
        if state is None:
            return Message("the root automaton")
        label = state_label(state)
        if not state.name.strip():
            return Message("the automaton of {state}", state=label)
        return Message("the automaton of the state {state}", state=label)
