"""An open document at one moment, and titles for those that have no file yet."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Final

from codegen.hfsm.code.names import component_name
from codegen.hfsm.document import Document
from visualhfsm.project._editing.document_file import FileState
from visualhfsm.project._editing.document_state import DocumentState
from visualhfsm.project._editing.undo_stack import Step

_LONGEST_BEGINNING: Final = 18  # characters before a number, as a component's name has 100 at most, in ASCII
_LONGEST_STEM: Final = 100
_STEPS: Final = 100  # that a version names; there may be more


@dataclass(frozen=True, slots=True, kw_only=True)
class Version:
    """An open document at one moment, as a value. Versions share the parts that did not change.

    `path` is its file, None as long as it has none; `dirty` says that the file differs, `title` is its name.
    """

    revision: int
    """The number of changes since it was opened."""
    document: Document
    path: Path | None
    title: str
    dirty: bool
    is_unsaved: bool
    """True if closing would lose changes."""
    undo: tuple[Step, ...]
    """The steps that can be undone, the latest first."""
    redo: tuple[Step, ...]
    file: FileState = "same"

    @classmethod
    def of(cls, state: DocumentState) -> Version:
        """Return the present version of a document."""
        steps, file, dirty = state.steps, state.file, state.dirty
        return cls(
            revision=steps.changes,
            document=steps.document,
            path=file.path,
            title=file.title,
            dirty=dirty,
            is_unsaved=dirty and (file.path is not None or bool(steps.past or steps.future)),
            undo=tuple(islice(reversed(steps.past), _STEPS)),
            redo=tuple(islice(reversed(steps.future), _STEPS)),
            file=file.state,
        )

    @property
    def component(self) -> str:
        """The name of its component, which follows from that of the file, or from the title without one."""
        return component_name(self.title if self.path is None else self.path.stem)


def stem(name: str) -> str:
    """Return the title for the name of a file: without its folder and its suffix."""
    return Path(name).stem[:_LONGEST_STEM] or "component"


def free_title(wanted: str, taken: Collection[str]) -> str:
    """Return a title, `untitled 2`, whose component is none of those that are taken."""
    titles = [wanted, *(f"{wanted[:_LONGEST_BEGINNING]} {number}" for number in range(2, len(taken) + 3))]
    return next(title for title in titles if component_name(title) not in taken)
