"""Run a trial of a behavior: in virtual time, as a plan says, in a separate process, judged at its end.

A plan says what varies from trial to trial, and what counts as success (`_plan.py`); `_trial.py` runs one,
`_processes.py` in another process, with the files of an archive, and `_series.py` several at a time. What
many trials say together is the plug-in `visualhfsm_trials`. See plugins/trials/docs/trials.md.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from zenoh_ice.lazy import import_on_use

if TYPE_CHECKING:
    from ._archive import Archive as Archive
    from ._archive import documents_of as documents_of
    from ._archive import make_archive as make_archive
    from ._archive import unpack as unpack
    from ._errors import TrialsError as TrialsError
    from ._failures import untried_failures as untried_failures
    from ._failures import ways_to_fail as ways_to_fail
    from ._failures import with_failure as with_failure
    from ._functions import FunctionFailed as FunctionFailed
    from ._functions import call_function as call_function
    from ._outcomes import Outcome as Outcome
    from ._outcomes import StateChange as StateChange
    from ._outcomes import failure_said as failure_said
    from ._outcomes import versions as versions
    from ._plan import FAILURE as FAILURE
    from ._plan import FATE as FATE
    from ._plan import FATE_AT as FATE_AT
    from ._plan import SUFFIX as SUFFIX
    from ._plan import Disturbance as Disturbance
    from ._plan import Function as Function
    from ._plan import Plan as Plan
    from ._plan import Success as Success
    from ._plan import plan_of as plan_of
    from ._plan import read_plan as read_plan
    from ._processes import Processes as Processes
    from ._processes import Task as Task
    from ._quantities import Quantity as Quantity
    from ._quantities import Same as Same
    from ._quantities import Spread as Spread
    from ._quantities import Value as Value
    from ._quantities import varies as varies
    from ._runners import Pool as Pool
    from ._runners import Sandbox as Sandbox
    from ._runners import Work as Work
    from ._runners import find_runner as find_runner
    from ._runners import find_sandbox as find_sandbox
    from ._series import LocalPool as LocalPool
    from ._series import ProcessPool as ProcessPool
    from ._series import Series as Series
    from ._series import run_tasks as run_tasks
    from ._trial import place_of as place_of
    from ._trial import quiet as quiet
    from ._trial import run_trial as run_trial

# The command line is read before any of them is needed.
__getattr__, __dir__ = import_on_use(__name__)
