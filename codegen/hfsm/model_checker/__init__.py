"""Check what automata can do, whatever their guards say: reachability, conflicts, deadlocks and properties.

`model` reads a document with its `guards`, `fireability` looks at each automaton alone, `transition_system`
is the exact behavior of several together, `exploration` searches it, and `checker` asks the questions, of
`reachability`, of `conflicts` between `commands`, of `properties`, and reports what was found.
`docs/explanation/model-checker.md` is for users.
"""

from __future__ import annotations

from .checker import (
    DEFAULT_LIMIT,
    QUICK_LIMIT,
    ModelReport,
    check_model,
    report_impossible,
    report_model,
    report_properties,
)
from .commands import Command, Commands, is_command, read_operations
from .conflicts import Conflict, Use
from .counterexample import Counterexample, Step, StepKind
from .expressions import ExpressionError
from .properties import PropertyResult, Verdict
from .reachability import Reachability, StateResult, TransitionResult, WhyNever

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
    "StateResult",
    "Step",
    "StepKind",
    "TransitionResult",
    "Use",
    "Verdict",
    "WhyNever",
    "check_model",
    "is_command",
    "read_operations",
    "report_impossible",
    "report_model",
    "report_properties",
]
