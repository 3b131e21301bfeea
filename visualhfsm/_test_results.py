"""What pytest reports of the tests of a document, and what the page gets of it."""

from __future__ import annotations

from typing import Literal

import msgspec

from visualhfsm._services import Push


class Hit(msgspec.Struct, frozen=True, array_like=True):
    """How often a state was `entered`, or a transition `fired`, in a test."""

    document: str
    """The absolute path of the document."""
    automaton: int
    kind: str
    id: int
    count: int


class TestResult(msgspec.Struct, frozen=True, kw_only=True):
    """How a test went: a line of the file that the plugin of pytest writes."""

    __test__ = False  # pytest would take it for tests

    name: str
    """Of its file and function, as pytest calls it."""
    outcome: Literal["passed", "failed", "skipped"]
    seconds: float = 0.0
    reason: str = ""
    timeline: str = ""
    hits: tuple[Hit, ...] = ()
    ended: tuple[Hit, ...] = ()
    """The states that were current when it failed."""


class TestView(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    """A test as the page shows it; without an outcome it was not run yet."""

    __test__ = False

    name: str
    file: str
    outcome: Literal["", "passed", "failed", "skipped"] = ""
    seconds: float = 0.0
    reason: str = ""
    timeline: str = ""


class Passed(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    """A state or a transition that tests passed, how often, and whether one failed there."""

    automaton: int
    kind: Literal["state", "transition"]
    id: int
    count: int
    failed: bool = False


class TestsPush(Push, tag="tests"):
    """The tests of a tab's document, how they went, and what they passed.

    `outdated` says that the document has changed since.
    """

    __test__ = False

    tab: int
    status: Literal["idle", "running", "stopping"] = "idle"
    tests: tuple[TestView, ...] = ()
    passed: tuple[Passed, ...] = ()
    outdated: bool = False
    error: str = ""
