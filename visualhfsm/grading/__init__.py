"""Grade submissions: documents of strangers, whose code runs in another process, behind walls.

An exercise has a task, trials and criteria (`_exercise.py`); a document earns points in its trials
(`_grade.py`). See docs/how-to/class.md.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from zenoh_ice.lazy import import_on_use

if TYPE_CHECKING:
    from ._containment import Containment as Containment
    from ._errors import GradingError as GradingError
    from ._errors import SandboxUnavailable as SandboxUnavailable
    from ._exercise import Exercise as Exercise
    from ._exercise import read_exercise as read_exercise
    from ._grade import Grader as Grader
    from ._marks import Marks as Marks
    from ._run import Run as Run
    from ._session import Allowance as Allowance
    from ._walls import check_walls as check_walls

_MODULES: Final = {
    "Allowance": "._session",
    "Containment": "._containment",
    "Exercise": "._exercise",
    "Grader": "._grade",
    "GradingError": "._errors",
    "Marks": "._marks",
    "Run": "._run",
    "SandboxUnavailable": "._errors",
    "check_walls": "._walls",
    "read_exercise": "._exercise",
}


# The command line is read before any of them is needed.
__getattr__ = import_on_use(__name__, _MODULES)
