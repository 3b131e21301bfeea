"""Say which names of the original generators a document uses without declaring to be old."""

from __future__ import annotations

import ast

from ...diagnostics import Location
from ...messages import Message
from .._old_names import LOCK
from ..analysis import Analysis
from ..code.text import all_nodes
from ..codes import Code
from .report import Report


def check_old_names(analysis: Analysis, report: Report) -> None:
    """Report each such name once, at its first use: people who did not expect it may have mistyped."""
    if analysis.document.is_old:
        return
    old = analysis.old_names
    for name, module in old.modules.items():
        if place := _first_read(analysis, name):
            message = Message(
                "`{name}` is imported, as the editor of 2017 did: add the library `{module}`",
                name=name,
                module=module,
            )
            report.note(Code.OLD_NAME, message, place)
    meanings = {alias: Message.verbatim(f"`self.{name}`") for alias, name in old.aliases.items()}
    meanings |= {LOCK: Message("a lock of all automata")} if old.has_lock else {}
    for name, meaning in meanings.items():
        place = next((each.place(0) for each in analysis.accesses if each.name == name), None)
        if place is not None:
            message = Message(
                "`self.{name}` is {meaning}, as in the components of 2017", name=name, meaning=meaning
            )
            report.note(Code.OLD_NAME, message, place)


def _first_read(analysis: Analysis, name: str) -> Location | None:
    """Return the place of the first use of a name of the file."""
    for piece in analysis.pieces:
        for node in all_nodes(piece.tree) if name in piece.free else ():
            if isinstance(node, ast.Name) and node.id == name:
                return piece.place(node)
    return None
