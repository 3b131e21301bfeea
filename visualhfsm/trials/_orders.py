"""What the editor asks of the process that runs trials, and what that process reports."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec
from msgspec import UNSET, UnsetType

from ._messages import PlanFacts, TrialsView

Action = Literal["look", "run", "record"]
ChosenRobot = Literal["", "sim", "fake", "none"]
ChosenRuns = Annotated[int, msgspec.Meta(ge=1, le=1_000_000)]
ChosenLimit = Annotated[float, msgspec.Meta(gt=0, le=86_400)]


class Choices(msgspec.Struct, frozen=True, kw_only=True):
    """What the user chose in the page: None and empty texts leave it to the plan, or to its defaults."""

    runs: ChosenRuns | None = None
    state: str = ""
    robot: ChosenRobot = ""
    limit: ChosenLimit | None = None


class Order(msgspec.Struct, frozen=True, kw_only=True):
    """What is to be done: look at the plan and the outcomes that are there, run, or record one trial."""

    action: Action
    document: str
    content: str
    """The file with the document as it is shown."""
    choices: Choices = Choices()
    workers: int = 1
    again: bool = False
    """Whether outcomes of an older version are replaced."""
    number: int = 0
    recording: str = ""


class Report(msgspec.Struct, frozen=True, kw_only=True):
    """How far it is; what is left out is as before. With an `error` nothing else is new."""

    plan: PlanFacts | UnsetType = UNSET
    view: TrialsView | UnsetType | None = UNSET
    left: float | None = None
    outdated: bool = False
    error: str = ""
