"""Grade submissions: documents of strangers, whose code runs in another process, behind walls.

An exercise has a task, trials and criteria (`_exercise.py`); a document earns points in its trials
(`_grade.py`). See docs/how-to/class.md.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from zenoh_ice.lazy import import_on_use

if TYPE_CHECKING:
    from ._containment import Containment as Containment
    from ._errors import GradingError as GradingError
    from ._errors import SandboxUnavailable as SandboxUnavailable
    from ._exercise import Exercise as Exercise
    from ._exercise import read_exercise as read_exercise
    from ._grade import Grader as Grader
    from ._handout import points_table as points_table
    from ._judged_run import JudgedRun as JudgedRun
    from ._marks import Marks as Marks
    from ._sandbox import Allowance as Allowance
    from ._walls import check_walls as check_walls

# The command line is read before any of them is needed.
__getattr__, __dir__ = import_on_use(__name__)
