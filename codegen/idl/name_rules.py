"""The rules for names and metadata, wherever they stand."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from codegen.diagnostics import Note, did_you_mean

from . import ast
from .codes import Code
from .resolver import Resolver, with_article

_RESERVED_SUFFIXES = ("Helper", "Holder", "Prx", "Ptr")
_KNOWN_METADATA = frozenset({"stream", "amd", "nonmutating", "protected", "delegate", "format", "deprecate"})


class NameRules:
    """Reports names and metadata that break a rule."""

    def __init__(self, resolver: Resolver) -> None:
        self._resolver = resolver

    def identifier(self, definition: ast.Definition) -> None:
        """Report a name that Slice reserves."""
        name, token = definition.name, definition.token
        if name.startswith("_") or name.endswith("_") or "__" in name:
            message = f"`{name}`: a name neither begins nor ends with an underscore nor has two together"
            self._resolver.error(Code.RESERVED_NAME, message, token)
        for suffix in _RESERVED_SUFFIXES:
            if name.endswith(suffix) and name != suffix:
                self._resolver.error(
                    Code.RESERVED_NAME, f"`{name}`: the suffix `{suffix}` is reserved", token
                )

    def metadata(self, definition: ast.Definition) -> None:
        """Report metadata that is unknown or out of place."""
        for metadata in definition.metadata:
            text = metadata.text
            if text == "stream" and not isinstance(definition, ast.Operation):
                message = f"only operations can be streamed, not {with_article(definition.kind)}"
                self._resolver.error(Code.BAD_STREAM, message, metadata.token)
            elif ":" not in text and text not in _KNOWN_METADATA:
                notes = did_you_mean(text, _KNOWN_METADATA)
                message = f'unknown metadata ["{text}"] is ignored'
                self._resolver.warning(Code.UNKNOWN_METADATA, message, metadata.token, *notes)

    def unique(
        self,
        items: Iterable[ast.Definition],
        scope: str,
        inherited: Mapping[str, ast.Definition] | None = None,
    ) -> None:
        """Report names that appear twice, or differ only in capitalization, or are inherited."""
        seen: dict[str, ast.Definition] = {}
        for item in items:
            item.scoped = f"{scope}::{item.name}"
            self.identifier(item)
            self.metadata(item)
            first = seen.setdefault(item.name.lower(), item)
            if first is not item:
                note = Note("first defined here", first.token.location)
                if first.name == item.name:
                    message = f"{item.kind} `{item.name}` is defined again"
                    self._resolver.error(Code.REDEFINITION, message, item.token, note)
                else:
                    message = f"{item.kind} `{item.name}` differs only in capitalization from `{first.name}`"
                    self._resolver.error(Code.CAPITALIZATION, message, item.token, note)
            elif inherited and item.name.lower() in inherited:
                base = inherited[item.name.lower()]
                note = Note("first defined here", base.token.location)
                message = f"{item.kind} `{item.name}` is inherited already"
                self._resolver.error(Code.REDEFINITION, message, item.token, note)
