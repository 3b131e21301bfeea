"""Code that was not written for today's components: a plug-in knows what it is, and which names it uses."""

# ruff: noqa: ARG002 - without the plug-in nothing is known, whatever the arguments are

from __future__ import annotations

from collections.abc import Set
from pathlib import Path
from typing import NamedTuple, Protocol

from zenoh_ice.plugins import NotInstalledError, optional

from ...diagnostics import Diagnostics, Note
from ...messages import Message
from ..document import Document


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


class FormerCode(Protocol):
    """What the plug-in knows about code; what this does itself is for programs without it."""

    def is_other_language(self, code: str) -> bool:
        """Return whether a piece of code is certainly not Python."""
        return False

    def language_of(self, document: Document) -> str:
        """Return the language that a document does not declare, blank for Python."""
        return ""

    def notes_about(self, code: str) -> list[Note]:
        """Return notes about the language of code that is not Python 3; none for code that is."""
        return []

    def modernize(self, document: Document, path: Path, diagnostics: Diagnostics, *, fixes: bool) -> Document:
        """Report code of former versions of Python; return a document in which it is fixed if `fixes` is set.

        Raises ModuleNotFoundError, which names the command that installs what is missing for that.
        """
        if fixes:
            raise ModuleNotFoundError(
                "what fixes former code is not installed: pip install 'visualhfsm[python2]'"
            )
        return document

    def former_names(
        self, document: Document, *, mentioned: Set[str], own: Set[str], free: Set[str], imported: Set[str]
    ) -> FormerNames:
        """Return the former names that the code of a document uses and that nothing else defines.

        The code has the attributes `mentioned`, and defines its `own`. It takes the `free` names from the
        file of the component, where libraries bind the `imported` ones.
        """
        return FormerNames({}, {}, {}, {}, {}, frozenset())


def former_code() -> FormerCode:
    """Return what is known about code."""
    try:
        plug_in: FormerCode = optional("visualhfsm_old_documents", "visualhfsm[old-documents]")
    except NotInstalledError:
        return _NotInstalled()
    return plug_in


class _NotInstalled(FormerCode):
    pass
