"""The rules for metadata."""

from __future__ import annotations

from codegen.diagnostics import did_you_mean

from . import ast
from .codes import Code
from .resolver import Resolver, with_article

_KNOWN = frozenset(
    {"stream", "stop", "amd", "nonmutating", "protected", "delegate", "format", "deprecate", "deprecated"}
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


def _dispatched(definition: ast.Definition) -> bool:
    """Return whether servants answer to it: an operation, or all those of an interface or a class."""
    declared = definition.of if isinstance(definition, ast.ForwardDeclaration) else type(definition)
    return issubclass(declared, ast.Operation | ast.Interface | ast.Class)


def check_metadata(definition: ast.Definition, resolver: Resolver) -> None:
    """Report metadata that is unknown or out of place."""
    for metadata in definition.metadata:
        text = metadata.text
        if text == "stream" and not isinstance(definition, ast.Operation):
            message = f"only operations can be streamed, not {with_article(definition.kind)}"
            resolver.error(Code.BAD_STREAM, message, metadata.token)
        elif text == "stop" and not isinstance(definition, ast.Operation):
            message = f'["stop"] is for the operation that stops, not for {with_article(definition.kind)}'
            resolver.error(Code.BAD_STOP, message, metadata.token)
        elif text == "amd" and not _dispatched(definition):
            kind = with_article(definition.kind)
            message = f'["amd"] is ignored: it is for operations and interfaces, not for {kind}'
            resolver.warning(Code.MISPLACED_AMD, message, metadata.token)
        elif ":" not in text and text not in _KNOWN:
            message = f'unknown metadata ["{text}"] is ignored'
            resolver.warning(Code.UNKNOWN_METADATA, message, metadata.token, *did_you_mean(text, _KNOWN))
