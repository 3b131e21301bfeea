"""Find code that may end the component, or its process: what is to come then never comes."""

from __future__ import annotations

import ast
from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Final

from ...diagnostics import Location, Note
from ...messages import Message
from ...parsing import parse_python
from .._extension import Extension
from ..analysis import Analysis, names_with
from ..code.text import all_nodes, dotted, full_name
from ._durations import called_in, hides, may_be_named

_ENDING: Final = frozenset({"os._exit", "os.abort", "os.kill", "signal.raise_signal"})
_ENDING_NAMES: Final = frozenset({"KeyboardInterrupt", "SystemExit", "exit", "quit"})
"""What ends it by these names, whatever has them: code may call a module by another name."""
_MESSAGE: Final = Message("this code may end the component")


def ending_code(analysis: Analysis) -> tuple[Note, ...]:
    """Return the places of code that may end the component, at most one for each piece of code."""
    names = {code.automaton.id: code.names for code in analysis.automata}
    found = []
    for _, _, piece in analysis.by_text.values():
        if piece is None or piece.is_deep:
            continue  # it is slow, too, or the component cannot be generated
        own = frozenset[str]() if piece.is_functions else names[piece.automaton]
        ends = next(_endings(all_nodes(piece.tree), analysis.libraries, own, piece.has_other_self), None)
        if ends is not None:
            found.append(Note(_MESSAGE, piece.place(ends)))
    if analysis.extension is not None and _may_end_by_hand(analysis.extension):
        found.append(Note(_MESSAGE, Location(analysis.extension.path)))
    return tuple(found)


def _may_end_by_hand(extension: Extension) -> bool:
    """Return whether hand-written code beside the document may end the component, called or not."""
    if extension.problem:
        return False  # the component cannot be generated
    nodes = all_nodes(parse_python(extension.source))
    return any(True for _ in _endings(nodes, {}, (), has_other_self=False))


def _endings(
    nodes: Sequence[ast.AST], libraries: Mapping[str, str], own: Collection[str], has_other_self: bool
) -> Iterator[ast.AST]:
    """Yield the nodes that may end the component; `own` are names that the document gives itself."""
    modules, called = names_with(libraries, nodes), called_in(nodes)
    for node in nodes:
        is_by_self = isinstance(node, ast.Attribute) and node.attr in _ENDING_NAMES and has_other_self
        if is_by_self or _may_end(node, modules, own) or hides(node, called, modules):
            yield node


def _may_end(node: ast.AST, modules: Mapping[str, str], own: Collection[str]) -> bool:
    """Return whether a node names what ends the component."""
    full = full_name(node, modules)
    if full in _ENDING:
        return True
    match node:
        case ast.Name(id=name):
            return full.split(".")[-1] in _ENDING_NAMES and name not in own
        case ast.Attribute(attr=name):  # an attribute of the component was given its value elsewhere
            return name in _ENDING_NAMES and dotted(node) != ["self", name]
        case ast.ImportFrom(names=names):
            return any(each.name in _ENDING_NAMES for each in names)
        case ast.Call():
            return may_be_named(node, _ENDING_NAMES, modules)
    return False
