"""What pytest reports of the tests of a document, and what the page gets of it."""

from __future__ import annotations

from typing import Literal

import msgspec

from codegen.messages import NO_MESSAGE, Message
from visualhfsm._document.places import Place
from visualhfsm._monitor.messages import Push


class TestView(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    """A test as the page shows it; without an outcome it was not run yet."""

    __test__ = False

    name: str
    file: str
    outcome: Literal["", "passed", "failed", "skipped"] = ""
    seconds: float = 0.0
    reason: Message = NO_MESSAGE
    timeline: str = ""


class Passed(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    """A state or a transition that tests passed, how often, and whether one failed there.

    Of a transition that was never passed it says how often its guard was `asked`, and how often that held.
    """

    automaton: int
    kind: Literal["state", "transition"]
    id: int
    count: int
    asked: int = 0
    held: int = 0
    failed: bool = False


class PassedCode(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    """The lines of a piece of code that tests passed, did not pass, and where one failed."""

    place: Place
    version: int
    """The version of the text that was tested."""
    passed: tuple[int, ...]
    missed: tuple[int, ...]
    failed: tuple[int, ...] = ()


class TestsPush(Push, tag="tests"):
    """The tests of a tab's document, how they went, and what they passed.

    `outdated` says that the document has changed since.
    """

    __test__ = False

    tab: int
    status: Literal["idle", "running", "stopping"] = "idle"
    tests: tuple[TestView, ...] = ()
    passed: tuple[Passed, ...] = ()
    code: tuple[PassedCode, ...] = ()
    """Of code as it is now: what has changed since is left out."""
    unmeasured: Message = NO_MESSAGE
    """Why it is not known which lines ran."""
    outdated: bool = False
    error: Message = NO_MESSAGE
