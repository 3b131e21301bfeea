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

from ._checker import ASSUMPTIONS as ASSUMPTIONS
from ._checker import DEFAULT_LIMIT as DEFAULT_LIMIT
from ._checker import QUICK_LIMIT as QUICK_LIMIT
from ._checker import ModelReport as ModelReport
from ._checker import check_model as check_model
from ._checker import report_graph as report_graph
from ._checker import report_model as report_model
from ._conflicts import Command as Command
from ._conflicts import Commands as Commands
from ._conflicts import Conflict as Conflict
from ._conflicts import is_command as is_command
from ._conflicts import read_operations as read_operations
from ._counterexample import Counterexample as Counterexample
from ._counterexample import CounterexampleStep as CounterexampleStep
from ._reachability import Reachability as Reachability
from ._reachability import WhyNever as WhyNever
from ._relied import relied_on as relied_on
from .expressions import ExpressionError as ExpressionError
from .properties import PropertyResult as PropertyResult
from .properties import Verdict as Verdict
from .transition_system import StepKind as StepKind
