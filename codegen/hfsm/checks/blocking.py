"""Find calls that hold an automaton up for longer than its period."""

from __future__ import annotations

import ast
from collections.abc import Collection, Iterable, Iterator, Mapping
from typing import Final

from ...diagnostics import Note
from ..analysis import Analysis, Piece, imported_names
from ..code.text import dotted, own_nodes
from ..code.values import milliseconds, seconds, truth
from ..codes import Code
from .report import Report

__all__ = ["check_blocking"]

_SLEEPS: Final = frozenset({"time.sleep", "self.sleep", "self.clock.sleep"})
_WAITS: Final = frozenset(
    {
        *("input", "os.system", "os.wait", "os.waitpid", "sys.stdin.read", "sys.stdin.readline"),
        *("getpass.getpass", "signal.pause"),
    }
)
"""What waits for a person or for another program, however long that takes."""
_WAITS_WITHOUT_TIMEOUT: Final = frozenset(
    {
        *(f"requests.{verb}" for verb in ("delete", "get", "head", "patch", "post", "put", "request")),
        *(f"subprocess.{call}" for call in ("call", "check_call", "check_output", "run")),
        *("socket.create_connection", "urllib.request.urlopen"),
    }
)
_EXITS: Final = frozenset({"exit", "os._exit", "quit", "sys.exit"})
_ENDLESS: Final = "this loop has no way out"


def check_blocking(analysis: Analysis, report: Report) -> None:
    """Check the code of all automata and the functions that it calls."""
    modules = analysis.libraries
    sleeps = _SLEEPS - {f"self.{name}" for name in analysis.defined}
    calls: dict[Piece | str, set[str]] = {}
    for access in analysis.accesses:
        calls.setdefault(access.function or access.piece, set()).add(access.name)
    shortest: dict[str, float] = {}
    for code in analysis.automata:
        period = milliseconds(code.automaton.iteration_time)
        if period is None:
            continue
        for piece in code.running():
            for node, message in _blocking(piece.tree, "self", modules, period, sleeps):
                _report(piece, node, message, period, report)
            for name in _called(calls.get(piece, ()), calls):
                shortest[name] = min(period, shortest.get(name, period))
        if code.variables is not None and not code.variables.is_deep:
            for node, message in _blocking(code.variables.tree, "self", modules, None, sleeps):
                _report(code.variables, node, message, None, report)
    for piece in analysis.functions:
        for function in piece.tree.body:
            if isinstance(function, ast.FunctionDef) and function.name in shortest:
                period = shortest[function.name]
                self_name = function.args.args[0].arg if function.args.args else ""
                for node, message in _blocking(function, self_name, modules, period, sleeps):
                    _report(piece, node, message, period, report)


def _report(
    piece: Piece, node: ast.expr | ast.stmt, message: str, period: float | None, report: Report
) -> None:
    if period is None:
        note = Note("the variables run before the first cycle, which waits for them")
    else:
        who = "a cycle that calls the function" if piece.is_functions else "the cycle"
        note = Note(f"{who} has {period:g} ms; wait with a timed transition instead, or look in each cycle")
    report.warning(Code.BLOCKING_CALL, message, piece.place(node), [note])


def _called(names: Iterable[str], calls: Mapping[Piece | str, set[str]]) -> set[str]:
    """Return the names of functions with those that they call in turn."""
    found: set[str] = set()
    pending = list(names)
    while pending:
        name = pending.pop()
        if name not in found:
            found.add(name)
            pending += calls.get(name, ())
    return found


def _blocking(
    tree: ast.AST, self_name: str, modules: Mapping[str, str], period: float | None, sleeps: Collection[str]
) -> Iterator[tuple[ast.expr | ast.stmt, str]]:
    modules = {**modules, **_imports(tree)}
    for node in own_nodes(tree):
        match node:
            case ast.Call(func=func):
                message = _blocking_call(node, _full_name(func, self_name, modules), period, sleeps)
                if message:
                    yield node, message
            case ast.While(test=test) if truth(test) is True and not _has_way_out(node):
                yield test, _ENDLESS
            case ast.For(iter=ast.Call(func=ast.Attribute(attr="samples"))) if not _has_way_out(node):
                yield node.iter, f"{_ENDLESS}: `samples` goes on as long as there are some"


def _blocking_call(call: ast.Call, name: str, period: float | None, sleeps: Collection[str]) -> str | None:
    if name in _WAITS:
        return f"`{name}` waits for as long as it takes"
    has_timeout = any(keyword.arg in ("timeout", None) for keyword in call.keywords)
    if name in _WAITS_WITHOUT_TIMEOUT and not has_timeout:
        return f"`{name}` waits for as long as it takes: it has no `timeout`"
    if name in sleeps and period is not None:
        argument = next(iter([*call.args, *(keyword.value for keyword in call.keywords)]), None)
        duration = None if argument is None else seconds(argument)
        if duration is not None and duration * 1000 > period:
            return f"`{name}` waits for {duration:g} s, longer than a period"
    return None


def _has_way_out(loop: ast.While | ast.For) -> bool:
    """Return whether a loop can be left: by `break`, by `return`, or by an exception that it raises."""
    pending: list[ast.AST] = list(loop.body)
    while pending:
        node = pending.pop()
        if isinstance(node, ast.Break | ast.Return | ast.Raise):
            return True
        if isinstance(node, ast.While | ast.For | ast.AsyncFor):
            # A `break` in there leaves the inner loop alone.
            inner = [other for other in own_nodes(node) if isinstance(other, ast.Return | ast.Raise)]
            if inner or any(_has_break(statement) for statement in node.orelse):
                return True
        elif isinstance(node, ast.Call) and _full_name(node.func, "self", {}) in _EXITS:
            return True
        elif not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef | ast.Lambda):
            pending += ast.iter_child_nodes(node)
    return False


def _has_break(node: ast.AST) -> bool:
    return isinstance(node, ast.Break) or any(isinstance(inner, ast.Break) for inner in own_nodes(node))


def _full_name(node: ast.expr, self_name: str, modules: Mapping[str, str]) -> str:
    """Return what is called by its full name, such as `time.sleep`, or an empty text."""
    first, *others = dotted(node) or [""]
    return ".".join(["self" if first == self_name else modules.get(first, first), *others])


def _imports(tree: ast.AST) -> dict[str, str]:
    found: dict[str, str] = {}
    for node in own_nodes(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            found.update(imported_names(node))
    return found
