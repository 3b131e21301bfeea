"""Check what automata can do, for all values of their guards: reachability, conflicts and properties.

From a document to a counterexample:

1. `model` reads the document: states, triggers, times, and `guards` as conjunctions of atoms. How guards
   answer comes from the `effects` of their code.
2. `fireability` bounds what each automaton can do alone: cheap, and correct for documents of any size.
3. `transition_system` is the exact behavior of several automata together, cycle by cycle.
4. `exploration` searches it within a budget: it is the only search.
5. The verdicts use that search: `reachability` of states and transitions, `conflicts` over servants, and
   `properties`, whose language is in `expressions`.
6. `counterexample` turns a run into steps that the editor plays.
7. `checker` runs all checks of a document, and reports the results; `relied` says what they rely on.

Users read `docs/explanation/model-checker.md`.
"""

from __future__ import annotations

from ._checker import (
    ASSUMPTIONS,
    DEFAULT_LIMIT,
    QUICK_LIMIT,
    ModelReport,
    check_model,
    report_graph,
    report_model,
)
from ._conflicts import Command, Commands, Conflict, is_command, read_operations
from ._counterexample import Counterexample, Step
from ._reachability import Reachability, WhyNever
from ._relied import Row, relied_on
from .expressions import ExpressionError
from .properties import PropertyResult, Verdict
from .transition_system import StepKind

__all__ = [
    "ASSUMPTIONS",
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
    "Row",
    "Step",
    "StepKind",
    "Verdict",
    "WhyNever",
    "check_model",
    "is_command",
    "read_operations",
    "relied_on",
    "report_graph",
    "report_model",
]
