"""Where the component of a document is generated: beside its file, or aside as long as there is none."""

from __future__ import annotations

import contextlib
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from codegen.diagnostics import Diagnostics
from codegen.hfsm import component_path, extension_path, write_document
from codegen.hfsm.document import Document
from visualhfsm.errors import VisualHfsmError
from visualhfsm.generation import generate_component
from visualhfsm.scratch import ScratchDirectory

from .origins import Origins, read_origins

__all__ = ["Generated", "RunDirectory"]

_UNTITLED: Final = "untitled"


class Generated:
    """A component that was written: its file, what the checks said, and where its lines come from."""

    def __init__(self, component: Path, diagnostics: Diagnostics, origins: Origins | None) -> None:
        self.component = component
        self.diagnostics = diagnostics
        self.origins = origins


class RunDirectory:
    """Generate the component of one document, again after each change.

    The component of a document that is saved is written beside it, as `codegen` does. One that has never been
    saved, or holds changes that its file lacks, is generated from a copy in a directory of its own, which
    `close` deletes; its component goes there, too, unless a component beside the file is to be renewed.
    """

    def __init__(self, include: Sequence[Path] = ()) -> None:
        self._include = tuple(include)
        self._aside: ScratchDirectory | None = None
        self._target: Path | None = None

    def generate(
        self, document: Document, path: Path | None, *, dirty: bool, beside: bool = False, title: str = ""
    ) -> Generated:
        """Write the component. Raises VisualHfsmError, which names the first error and counts the others.

        Without a `path` the component is called after the `title`, if that can be the name of a module.
        `beside` writes it beside the file also when that lacks the changes. Once written somewhere it stays
        there: that is where a running component looks for its new self.
        """
        diagnostics = Diagnostics()
        if path is not None and not dirty:
            source, include = path, self._include
        else:
            source = self._copy(document, path.name if path else f"{_module_name(title)}.xml")
            include = (*((path.parent,) if path else ()), *self._include)
        target = self._target or (path.parent if beside and path else source.parent)
        if path is not None and self._aside is not None and target == self._aside.path:
            _copy_extension(path, source)
        component = generate_component(source, target, diagnostics, include)
        if component is None:
            raise VisualHfsmError(_summary(diagnostics))
        self._target = target
        return Generated(component, diagnostics, read_origins(source, component))

    def close(self) -> None:
        """Delete what stands aside."""
        aside, self._aside, self._target = self._aside, None, None
        if aside is not None:
            aside.close()

    def _copy(self, document: Document, name: str) -> Path:
        try:
            if self._aside is None:
                self._aside = ScratchDirectory()
            source = self._aside.path / name
            source.write_text(write_document(document), encoding="utf-8")
        except OSError as error:
            raise VisualHfsmError(f"nothing was generated: {error.strerror}: {error.filename}") from error
        return source


def _module_name(title: str) -> str:
    return title if title.isascii() and title.isidentifier() else _UNTITLED


def _copy_extension(path: Path, copy: Path) -> None:
    """Copy what was written by hand beside a document to its copy, where it is looked for."""
    with contextlib.suppress(FileNotFoundError):
        shutil.copyfile(
            extension_path(component_path(path, None)), extension_path(component_path(copy, None))
        )


def _summary(diagnostics: Diagnostics) -> str:
    errors = diagnostics.errors
    first = errors[0]
    more = f" (and {len(errors) - 1} more)" if len(errors) > 1 else ""
    return f"nothing was generated: {first.message}{more}"
