"""Run a behavior many times in virtual time, and say how often it succeeds, and what that depends on.

A plan says what varies from trial to trial (`_plan.py`); `_series.py` runs its trials, in processes of this
computer or on a cluster of Dask, and `_summary.py` has what they say. See docs/how-to/trials.md.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from zenoh_ice.lazy import import_on_use

if TYPE_CHECKING:
    from ._errors import TrialsError as TrialsError
    from ._outcome import Outcome as Outcome
    from ._plan import Disturbance as Disturbance
    from ._plan import Plan as Plan
    from ._plan import Success as Success
    from ._plan import plan_of as plan_of
    from ._plan import read_plan as read_plan
    from ._quantities import Spread as Spread
    from ._series import run_trials as run_trials
    from ._summary import Summary as Summary

_MODULES: Final = {
    "Disturbance": "._plan",
    "Outcome": "._outcome",
    "Plan": "._plan",
    "Spread": "._quantities",
    "Success": "._plan",
    "Summary": "._summary",
    "TrialsError": "._errors",
    "plan_of": "._plan",
    "read_plan": "._plan",
    "run_trials": "._series",
}


# The command line is read before any of them is needed.
__getattr__ = import_on_use(__name__, _MODULES)
