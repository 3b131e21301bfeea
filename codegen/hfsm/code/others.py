"""Code that was not written for today's components: plug-ins know what it is, and which names it relies on.

They are found as entry points of the group `codegen.code`.
"""

from __future__ import annotations

from collections.abc import Set
from functools import cache
from pathlib import Path
from typing import Final, NamedTuple, Protocol

from zenoh_ice import plugins

from ...diagnostics import Diagnostics, Note
from ...messages import Message
from ..document import Document

SEAM: Final = "codegen.code"


class Given(NamedTuple):
    """An attribute that a component gets: the expression of its value, and what it is in words."""

    expression: str
    meaning: Message


class FormerNames(NamedTuple):
    """The names that code uses and only former generators provided, all of which a component gets.

    `modules` are imported, each with its full name. `aliases` are attributes of the component, each with what
    it stands for, such as `motors` or `scanSub.value`, and `attributes` others. `messages` are types of ROS
    by their short name, and `clients` former methods by the interface that code calls them on.
    `reserved` are names that mean nothing else in any component.
    """

    modules: dict[str, str]
    aliases: dict[str, str]
    messages: dict[str, str]
    clients: dict[str, frozenset[str]]
    attributes: dict[str, Given]
    reserved: frozenset[str]


class OtherCode(Protocol):
    """What a plug-in knows about code, as a module or an object."""

    def is_other_language(self, code: str) -> bool:
        """Return whether a piece of code is certainly not Python."""

    def language_of(self, document: Document) -> str:
        """Return the language that a document does not declare, blank for Python."""

    def notes_about(self, code: str) -> list[Note]:
        """Return notes about the language of code that is not Python 3; none for code that is."""

    def modernize(self, document: Document, path: Path, diagnostics: Diagnostics, *, fixes: bool) -> Document:
        """Report code of former versions of Python; return a document in which it is fixed if `fixes` is set.

        Raises ModuleNotFoundError, which names the command that installs what is missing for that.
        """

    def former_names(
        self, document: Document, *, mentioned: Set[str], own: Set[str], free: Set[str], imported: Set[str]
    ) -> FormerNames:
        """Return the former names that the code of a document uses and that nothing else defines.

        The code has the attributes `mentioned`, and defines its `own`. It takes the `free` names from the
        file of the component, where libraries bind the `imported` ones.
        """


@cache
def others() -> tuple[OtherCode, ...]:
    """Return what is installed."""
    return tuple(each for _, each in plugins.each(SEAM))


def is_other_language(code: str) -> bool:
    """Return whether a piece of code is certainly not Python, as far as plug-ins know."""
    return any(each.is_other_language(code) for each in others())


def language_of(document: Document) -> str:
    """Return the language that a document does not declare, blank for Python."""
    return next((found for each in others() if (found := each.language_of(document))), "")


def notes_about(code: str) -> list[Note]:
    """Return notes about the language of code that is not Python 3; none for code that is."""
    return [note for each in others() for note in each.notes_about(code)]


def modernize(document: Document, path: Path, diagnostics: Diagnostics, *, fixes: bool) -> Document:
    """Return a document whose code is today's, as `OtherCode` says.

    Raises ModuleNotFoundError when it `fixes` and nothing for that is installed.
    """
    if fixes and not others():
        raise ModuleNotFoundError(
            "what fixes former code is not installed: pip install 'visualhfsm[python2]'"
        )
    for each in others():
        document = each.modernize(document, path, diagnostics, fixes=fixes)
    return document


def former_names(
    document: Document, *, mentioned: Set[str], own: Set[str], free: Set[str], imported: Set[str]
) -> FormerNames:
    """Return the former names that code uses, as `OtherCode` says."""
    found = FormerNames({}, {}, {}, {}, {}, frozenset())
    for each in others():
        more = each.former_names(document, mentioned=mentioned, own=own, free=free, imported=imported)
        found = FormerNames(
            found.modules | more.modules,
            found.aliases | more.aliases,
            found.messages | more.messages,
            found.clients | more.clients,
            found.attributes | more.attributes,
            found.reserved | more.reserved,
        )
    return found
