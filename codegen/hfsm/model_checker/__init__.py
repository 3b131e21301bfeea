"""Check what automata can do, whatever their guards say: reachability, conflicts and properties.

The path, from a document to a counterexample:

1. `model` reads the document: states, triggers, times, and `guards` as conjunctions of atoms.
2. `fireability` bounds what each automaton can do alone: cheap, and right however large the document is.
3. `transition_system` is the exact behavior of some automata together, one cycle after the other.
4. `exploration` searches it within a budget: the only search there is.
5. The verdicts read that search: `reachability` of states and transitions, `conflicts` over servants, which
   `commands` finds in the code, and `properties`, whose language is in `expressions`.
6. `counterexample` turns a run into the steps that the editor plays.
7. `checker` asks all questions of a document, and reports what was found.

`docs/explanation/model-checker.md` is for users.
"""

from __future__ import annotations

from .checker import DEFAULT_LIMIT, QUICK_LIMIT, ModelReport, check_model, report_model
from .conflicts import Command, Commands, Conflict, is_command, read_operations
from .counterexample import Counterexample, Step, StepKind
from .expressions import ExpressionError
from .properties import PropertyResult, Verdict
from .reachability import Reachability, WhyNever

__all__ = [
    "DEFAULT_LIMIT",
    "QUICK_LIMIT",
    "Command",
    "Commands",
    "Conflict",
    "Counterexample",
    "ExpressionError",
    "ModelReport",
    "PropertyResult",
    "Reachability",
    "Step",
    "StepKind",
    "Verdict",
    "WhyNever",
    "check_model",
    "is_command",
    "read_operations",
    "report_model",
]
