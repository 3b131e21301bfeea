"""Report statements that do nothing: a call without its parentheses, a comparison that stands alone."""

from __future__ import annotations

import ast

from ...diagnostics import Note
from ...messages import Message
from ..analysis import Analysis, Piece
from ..code.text import all_nodes
from ..codes import Code
from ..report import Report


def check_idle(analysis: Analysis, report: Report) -> None:
    """Check all statements of a document."""
    for piece in analysis.pieces:
        if not piece.is_expression:
            _check_piece(piece, report)


def _check_piece(piece: Piece, report: Report) -> None:
    nodes = [*all_nodes(piece.tree)]
    tries = {id(statement) for each in nodes if isinstance(each, ast.Try) for statement in each.body}
    for node in nodes:
        if not isinstance(node, ast.Expr) or id(node) in tries:  # there, code may ask whether it is there
            continue
        match node.value:
            case ast.Attribute():
                code = ast.unparse(node.value)
                message = Message("`{code}` does nothing: it is not called", code=code)
                note = Message("call it as {example}", example=f"`{code}()`")
            case ast.Compare(left=ast.Name() | ast.Attribute() as left, ops=[ast.Eq()], comparators=[right]):
                code = ast.unparse(node.value)
                message = Message("`{code}` compares, and does nothing else", code=code)
                example = f"`{ast.unparse(left)} = {ast.unparse(right)}`"
                note = Message("to assign it, write {example}", example=example)
            case _:
                continue
        report.warning(Code.DOUBTFUL_CODE, message, piece.place(node.value), [Note(note)])
