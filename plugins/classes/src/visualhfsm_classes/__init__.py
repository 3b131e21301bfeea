"""Grade submissions: documents of strangers, whose code runs in another process, behind walls.

An exercise has a task, trials and criteria (`_exercise.py`); a document earns points in its trials
(`_grade.py`). See plugins/classes/docs/class.md.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from zenoh_ice.lazy import import_on_use

if TYPE_CHECKING:
    from visualhfsm_classes._containment import Containment as Containment
    from visualhfsm_classes._doctor import check_grading as check_grading
    from visualhfsm_classes._errors import GradingError as GradingError
    from visualhfsm_classes._errors import SandboxUnavailable as SandboxUnavailable
    from visualhfsm_classes._exercise import Exercise as Exercise
    from visualhfsm_classes._exercise import read_exercise as read_exercise
    from visualhfsm_classes._grade import Grader as Grader
    from visualhfsm_classes._handout import points_table as points_table
    from visualhfsm_classes._handout import pupils_folder as pupils_folder
    from visualhfsm_classes._judged_run import JudgedRun as JudgedRun
    from visualhfsm_classes._marks import Marks as Marks
    from visualhfsm_classes._sandbox import Allowance as Allowance
    from visualhfsm_classes._walls import check_walls as check_walls

# The command line is read before any of them is needed.
__getattr__, __dir__ = import_on_use(__name__)
