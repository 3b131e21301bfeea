"""What is said of trials between the page, the editor and the process that runs them.

The page gets their plan in words, how they go, and what they say; the process gets an `Order`, and reports.
"""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec
from msgspec import UNSET, UnsetType

from codegen.messages import NO_MESSAGE, Message
from visualhfsm.plugins import Rate, ViewPush
from visualhfsm.trials import StateChange


class _View(msgspec.Struct, frozen=True, rename="camel"):
    pass


class Histogram(_View, frozen=True):
    """A number over all trials: between two `edges` so many `good` and `bad` trials."""

    name: str
    median: float
    lower: float
    upper: float
    edges: list[float]
    good: list[int]
    bad: list[int]


class PartView(_View, frozen=True):
    """The trials with a value of a quantity, or one in a range, and the means of the plan's own numbers."""

    label: str
    share: Rate
    means: list[tuple[str, float]]


class Dependence(_View, frozen=True):
    """How success depends on a quantity."""

    name: str
    parts: list[PartView]


class PlaceMap(_View, frozen=True):
    """The places of a thing in m, with success and number of each trial, and lines on the floor.

    Of very many trials only some are shown, evenly: `trials` is how many there are.
    """

    thing: str
    places: list[tuple[float, float, bool, int]]
    trials: int
    lines: list[tuple[float, float, float, float]]


class TrialTimeline(_View, frozen=True):
    """The states of a trial up to its end."""

    number: int
    end: float
    changes: list[StateChange]


class FailureView(_View, frozen=True):
    """A way to fail: so many trials, the numbers of some, and the timeline of one."""

    reason: Message
    states: str
    count: int
    numbers: list[int]
    timeline: TrialTimeline


class Trial(_View, frozen=True):
    """One of the worst trials; `page` is that of its recording, if there is one."""

    number: int
    success: bool
    reason: Message
    time: float
    states: str
    values: list[tuple[str, str]]
    timeline: TrialTimeline
    page: str = ""


class Origin(_View, frozen=True):
    """What figures are of, for who prints them."""

    document: str
    seed: int
    digest: str
    """Of the plan and of the files beside the document."""
    versions: dict[str, str]
    date: str
    """When the last trial had ended, as in ISO 8601."""
    commit: str
    """The commit of the document in git, with `+` if its folder has been changed since; empty without."""


class TrialsView(_View, frozen=True):
    """A series of trials; `planned` are more than `share.trials` while it runs.

    `looks` is how many were asked for, one time after the other: several if some were added after a look.
    `from_start` of them succeed before anything happens; `equal` says that nothing differs between several.
    """

    name: str
    planned: int
    looks: list[int]
    share: Rate
    histograms: list[Histogram]
    dependences: list[Dependence]
    maps: list[PlaceMap]
    ways: list[FailureView]
    worst: list[Trial]
    from_start: int
    equal: bool
    origin: Origin | None = None


class Fact(_View, frozen=True):
    """A name in a plan, and what it is in words."""

    name: str
    words: Message


class PlanFacts(_View, frozen=True):
    """A plan in words; `file` is empty where there is none, so that everything has its default."""

    file: str
    runs: int
    seed: int
    limit: float
    robot: str
    state: str
    """The path of states that a trial must reach; empty for none."""
    varies: list[Fact]
    fixed: list[Fact]
    happens: list[Fact]
    counts: list[Message]
    """The other conditions of success."""
    measures: list[str]


class TrialsPush(ViewPush, kw_only=True, tag="view"):
    """The trials of a tab's document: their plan, and what those that have ended say.

    `outdated` says that they are of an older version of document, plan or the files beside them, `opens` that
    one of them can be run again to be recorded. `left` is
    the time in s that the others will take, as far as is known; `recording` the number of the trial that is
    run again to be recorded, `recorded` that of the last one in the file `file`.
    """

    name: str = "trials"
    status: Literal["reading", "idle", "running", "stopping"] = "idle"
    plan: PlanFacts | None = None
    view: TrialsView | None = None
    workers: int = 0
    left: float | None = None
    opens: bool = False
    error: Message = NO_MESSAGE
    recording: int | None = None
    recorded: int | None = None
    file: str = ""


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
    body: str = ""


class Order(msgspec.Struct, frozen=True, kw_only=True):
    """What is to be done: look at the plan and the outcomes that are there, run, or record one trial."""

    action: Action
    document: str
    content: str
    """The file with the document as it is shown."""
    choices: Choices = Choices()
    workers: int = 1
    again: bool = False
    """True to replace outcomes of an older version."""
    number: int = 0
    recording: str = ""


class Report(msgspec.Struct, frozen=True, kw_only=True):
    """How far it is; what is left out is as before. With an `error` nothing else is new."""

    plan: PlanFacts | UnsetType = UNSET
    view: TrialsView | UnsetType | None = UNSET
    left: float | None = None
    outdated: bool = False
    error: Message = NO_MESSAGE
