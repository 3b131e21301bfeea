"""Find calls that block an automaton for longer than its period."""

from __future__ import annotations

import ast
from typing import Final

from ...diagnostics import Note
from ...graphs import reached
from ...messages import Message
from .._calls import Lasts, lasts
from ..analysis import Analysis, Piece, names_with
from ..code._values import milliseconds, seconds, truth
from ..code.text import full_name, own_nodes
from ..codes import Code
from ..report import Report

_ENDLESS: Final = Message("this loop never ends")
_LONGEST: Final = 86_400.0
"""A sleep of more s has no end that anybody waits for."""


def check_blocking(analysis: Analysis, report: Report) -> None:
    """Check the code of all automata and the functions that it calls."""
    checker = _Checker(analysis, report)
    calls: dict[Piece | str, set[str]] = {}
    for access in analysis.accesses:
        calls.setdefault(access.function or access.piece, set()).add(access.name)
    shortest: dict[str, float] = {}
    for code in analysis.automata:
        period = milliseconds(code.automaton.iteration_time)
        if period is None:
            continue
        for piece in code.sharing():
            checker.check(piece, piece.tree, "self", None if piece is code.variables else period)
            begun = calls.get(piece, ()) if piece is not code.variables else ()
            for name in reached(begun, lambda each: calls.get(each, ())):
                shortest[name] = min(period, shortest.get(name, period))
    for piece in analysis.functions:
        for function in piece.tree.body:
            if isinstance(function, ast.FunctionDef) and function.name in shortest:
                self_name = function.args.args[0].arg if function.args.args else ""
                checker.check(piece, function, self_name, shortest[function.name])


class _Checker:
    def __init__(self, analysis: Analysis, report: Report) -> None:
        self._libraries = analysis.libraries
        self._own = {f"self.{name}" for name in analysis.defined}
        self._report = report

    def check(self, piece: Piece, tree: ast.AST, self_name: str, period: float | None) -> None:
        """Check a piece of code, or a function in it; `period` is in ms, None before the first cycle."""
        if period is None:
            note = Note(Message("the variables are set before the first cycle, which waits for them"))
        else:
            who = Message("a cycle that calls the function") if piece.is_functions else Message("the cycle")
            advice = Message("wait with a timed transition instead, or check in each cycle")
            note = Note(Message("{who} has {period:g} ms; {advice}", who=who, period=period, advice=advice))
        modules = {**names_with(self._libraries, own_nodes(tree)), self_name: "self"}
        guarded = {id(inner) for node in own_nodes(tree) for inner in _guarded(node)}
        for node in own_nodes(tree):
            code = Code.BLOCKING_CALL
            match node:
                case ast.Call(func=func) as where:
                    name = full_name(func, modules)
                    how = Lasts.UNKNOWN if name in self._own else lasts(name)
                    message = _blocking(node, name, how, period)
                    if message is not None and how is Lasts.SLEEPS and _duration(node) > _LONGEST:
                        code = Code.ENDLESS_CODE
                case ast.While(test=where) if truth(where) is True and not _has_way_out(node):
                    message = _ENDLESS
                    if not piece.is_functions and id(node) not in guarded:  # a function may run on a thread
                        code = Code.ENDLESS_CODE
                case ast.For(iter=ast.Call(func=ast.Attribute(attr="samples")) as where) if not _has_way_out(
                    node
                ):
                    message = Message(
                        "this loop never ends: `samples` continues as long as there are samples"
                    )
                case _:
                    continue
            if message is not None:
                self._report.warning(code, message, piece.place(where), [note])


def _blocking(call: ast.Call, name: str, how: Lasts, period: float | None) -> Message | None:
    """Return why a call of a function, given by its full name, blocks, or None if it does not."""
    has_timeout = any(keyword.arg in ("timeout", None) for keyword in call.keywords)
    duration = _duration(call)
    if how is Lasts.WAITS:
        return Message("`{name}` waits without a limit", name=name)
    if how is Lasts.WAITS_WITHOUT_TIMEOUT and not has_timeout:
        return Message("`{name}` waits without a limit: it has no `timeout`", name=name)
    if how is Lasts.SLEEPS and period is not None and duration * 1000 > period:
        return Message(
            "`{name}` waits for {duration:g} s, longer than the period", name=name, duration=duration
        )
    return None


def _duration(sleep: ast.Call) -> float:
    """Return for how many s a call sleeps; 0 if that is not known."""
    argument = next(iter([*sleep.args, *(keyword.value for keyword in sleep.keywords)]), None)
    return (None if argument is None else seconds(argument)) or 0.0


def _guarded(node: ast.AST) -> list[ast.AST]:
    """Return what an exception may end that is caught: the nodes in a `try`, or a `with`."""
    if isinstance(node, ast.With) or (isinstance(node, ast.Try) and node.handlers):
        return [inner for statement in node.body for inner in ast.walk(statement)]
    return []


def _has_way_out(loop: ast.While | ast.For) -> bool:
    """Return whether a loop can end: by `break`, `return` or `raise`."""
    pending: list[ast.AST] = list(loop.body)
    while pending:
        node = pending.pop()
        if isinstance(node, ast.Break | ast.Return | ast.Raise):
            return True
        if isinstance(node, ast.While | ast.For | ast.AsyncFor):
            # A `break` in there ends only the inner loop.
            inner = [other for other in own_nodes(node) if isinstance(other, ast.Return | ast.Raise)]
            if inner or any(_has_break(statement) for statement in node.orelse):
                return True
        elif isinstance(node, ast.Call) and lasts(full_name(node.func, {})) is Lasts.ENDS:
            return True
        elif not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef | ast.Lambda):
            pending += ast.iter_child_nodes(node)
    return False


def _has_break(node: ast.AST) -> bool:
    return isinstance(node, ast.Break) or any(isinstance(inner, ast.Break) for inner in own_nodes(node))
