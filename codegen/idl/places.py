"""Where definitions go: which Python module of which package."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field

from . import ast
from .lexer import Source
from .names import exported_names, file_module, module_package


@dataclass(slots=True)
class GeneratedModule:
    """A Python module: what one IDL file defines in one Slice module."""

    source: Source
    slice_module: str
    """The scoped name of the Slice module: `jderobot`."""
    doc: str | None = None
    """The raw doc comment of the Slice module in this file."""
    definitions: list[ast.Definition] = field(default_factory=list)
    name: str = ""

    @property
    def package(self) -> tuple[str, ...]:
        """The path of packages that it stands in."""
        return module_package(self.slice_module)


class Places:
    """The Python modules for everything that a translation unit defines."""

    def __init__(self, root: ast.Module) -> None:
        self._modules: dict[tuple[Source, str], GeneratedModule] = {}
        nested: defaultdict[str, set[str]] = defaultdict(set)
        for module, definition in _walk(root):
            if isinstance(definition, ast.Module):
                nested[module.scoped.removeprefix("::")].add(definition.name)
            elif not isinstance(definition, ast.ForwardDeclaration):
                place = self._place(definition.token.source, definition.module)
                place.definitions.append(definition)
                place.doc = place.doc or module.doc
        for place in self._modules.values():
            taken = {name for definition in place.definitions for name in exported_names(definition)}
            place.name = file_module(place.source.path, taken | nested[place.slice_module])

    def _place(self, source: Source, module: str) -> GeneratedModule:
        return self._modules.setdefault((source, module), GeneratedModule(source, module))

    def of(self, definition: ast.Definition) -> GeneratedModule:
        """Return the module that a definition goes to."""
        return self._modules[definition.token.source, definition.module]

    def modules_of(self, source: Source) -> list[GeneratedModule]:
        """Return the modules that a file makes."""
        return [module for module in self._modules.values() if module.source is source]


def _walk(module: ast.Module) -> Iterator[tuple[ast.Module, ast.Definition]]:
    for definition in module.definitions:
        yield module, definition
        if isinstance(definition, ast.Module):
            yield from _walk(definition)
