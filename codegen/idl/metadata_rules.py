"""The rules for metadata."""

from __future__ import annotations

from codegen.diagnostics import did_you_mean

from . import ast
from .codes import Code
from .resolver import Resolver, with_article

_KNOWN = frozenset(
    {"stream", "amd", "nonmutating", "protected", "delegate", "format", "deprecate", "deprecated"}
)
_KNOWN |= {
    "async-oneway",
    "bitset",
    "deepcopy",
    "marshaled-result",
    "preserve-slice",
    "property",
    "UserException",
}


def check_metadata(definition: ast.Definition, resolver: Resolver) -> None:
    """Report metadata that is unknown or out of place."""
    for metadata in definition.metadata:
        text = metadata.text
        if text == "stream" and not isinstance(definition, ast.Operation):
            message = f"only operations can be streamed, not {with_article(definition.kind)}"
            resolver.error(Code.BAD_STREAM, message, metadata.token)
        elif ":" not in text and text not in _KNOWN:
            message = f'unknown metadata ["{text}"] is ignored'
            resolver.warning(Code.UNKNOWN_METADATA, message, metadata.token, *did_you_mean(text, _KNOWN))
