"""What the page gets of trials: their plan in words, how they go, and what they say."""

from __future__ import annotations

from typing import Literal

import msgspec

from visualhfsm._services import Push

from ._outcome import Change


class _View(msgspec.Struct, frozen=True, rename="camel"):
    pass


class Share(_View, frozen=True):
    """How many of some trials succeed, with the interval of the true rate."""

    successes: int
    trials: int
    lowest: float
    highest: float


class Histogram(_View, frozen=True):
    """A number over all trials: between two `edges` so many `good` and `bad` trials."""

    name: str
    median: float
    lower: float
    upper: float
    edges: list[float]
    good: list[int]
    bad: list[int]


class Part(_View, frozen=True):
    """The trials with a value of a quantity, or one in a range, and the means of the plan's own numbers."""

    label: str
    share: Share
    means: list[tuple[str, float]]


class Dependence(_View, frozen=True):
    """How success depends on a quantity."""

    name: str
    parts: list[Part]


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
    changes: list[Change]


class Way(_View, frozen=True):
    """A way to fail: so many trials, the numbers of some, and the timeline of one."""

    reason: str
    states: str
    count: int
    numbers: list[int]
    timeline: TrialTimeline


class Trial(_View, frozen=True):
    """One of the worst trials; `page` is that of its recording, if there is one."""

    number: int
    success: bool
    reason: str
    time: float
    states: str
    values: list[tuple[str, str]]
    timeline: TrialTimeline
    page: str = ""


class TrialsView(_View, frozen=True):
    """A series of trials; `planned` are more than `share.trials` while it runs."""

    name: str
    planned: int
    share: Share
    histograms: list[Histogram]
    dependences: list[Dependence]
    maps: list[PlaceMap]
    ways: list[Way]
    worst: list[Trial]


class Fact(_View, frozen=True):
    """A name in a plan, and what it is in words."""

    name: str
    words: str


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
    counts: list[str]
    """What else a trial must do to succeed."""
    measures: list[str]


class TrialsPush(Push, tag="trials"):
    """The trials of a tab's document: their plan, and what those that have ended say.

    `outdated` says that they are of an older version of document, plan or the files beside them. `left` is
    the time in s that the others will take, as far as is known; `recording` the number of the trial that is
    run again to be recorded, `recorded` that of the last one in the file `file`.
    """

    tab: int
    status: Literal["reading", "idle", "running", "stopping"] = "idle"
    plan: PlanFacts | None = None
    view: TrialsView | None = None
    workers: int = 0
    left: float | None = None
    outdated: bool = False
    error: str = ""
    recording: int | None = None
    recorded: int | None = None
    file: str = ""
