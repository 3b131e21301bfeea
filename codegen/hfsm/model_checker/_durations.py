"""Find code that is not certainly quick: its cycle may last for longer than its period, or forever.

While a cycle lasts, others fall due and are missed, so that timers that expire one after the other in the
model may expire together; and what is to come may never come. Quick is what consists of the forms below and
of what the table of `_calls` has. Calls of servants are taken to end within a period.

Where all code is quick, no object but those that the table makes is anywhere: hence operators, attributes and
loops are as quick as theirs are. One place that is not makes the whole document slow.
"""

from __future__ import annotations

import ast
import re
import stat
from collections.abc import Iterator
from itertools import islice
from math import inf, prod
from pathlib import Path
from typing import Final

from ...diagnostics import Location, Note
from ...messages import Message
from .._calls import BASES, CALLED, DECORATORS, LOADED, LOCKS, QUICK_METHODS, Lasts, lasts
from .._definitions import is_static
from .._effects import CodeEffects
from .._possible_values import HARMLESS
from ..analysis import Piece, names_with
from ..code.names import COMPONENT_ATTRIBUTES
from ..code.text import all_nodes, binds, child_nodes, dotted, own_nodes
from ..document import Document
from ._growth import Values, last_name, named

_SLOW: Final = Message("this code may take longer than a period, and timers may expire in any order")
_ENDS: Final = Message("this code may end the component")
_OTHER_FORMS: Final = (
    *(ast.AsyncFor, ast.AsyncFunctionDef, ast.AsyncWith, ast.Await, ast.LShift, ast.MatMult, ast.TryStar),
    *(each for each in (getattr(ast, name, None) for name in ("TypeAlias", "TemplateStr")) if each),
)
_MOST_SHOWN: Final = 3
_MOST_WORK: Final = 100_000
"""The most nodes of its tree that a piece of code may run through."""
_TURNS: Final = 100
"""How often a loop is taken to turn where nothing says how often."""
_LARGEST: Final = 1 << 20
"""The largest whole number that code may name, and the largest file that it may read, in bytes."""
_LATER: Final = (ast.GeneratorExp, ast.Yield, ast.YieldFrom)
"""What runs where others go through what it makes."""
_COPIES: Final = ("list", "range", "sorted", "tuple")
_WIDE: Final = re.compile(r"%[^a-zA-Z%]*(\d{3}|\*)")
"""A format that makes a long text."""
_PICTURES: Final = frozenset(
    {
        *(".array", ".asarray", ".astype", ".cvtColor", ".flatten", ".frombuffer", ".inRange", ".pixelData"),
        *(".reshape", ".tolist"),
    }
)
"""What has or gives the parts of pictures."""


def slow_code(effects: CodeEffects) -> tuple[tuple[Note, ...], tuple[Note, ...]]:
    """Return the places of code that is not certainly quick, and of code that may end the component.

    There is at most one for each piece of code, and few of code that is not quick: one is enough for all.
    """
    analysis, finder = effects.analysis, _Finder(effects)
    slow: list[Note] = []
    ending: list[Note] = []
    if analysis.extension is not None and not analysis.extension.problem:
        slow.append(Note(_SLOW, Location(analysis.extension.path)))
    elif finder.is_unclear:
        slow.append(Note(_SLOW, Location(analysis.path)))
    for text, path, piece in analysis.by_text.values():
        if piece is not None and piece.is_deep:
            slow.append(Note(_SLOW, Location(path, max(1, text.line), max(1, text.column))))
        elif piece is not None:  # otherwise the component cannot be generated
            slow += [Note(_SLOW, piece.place(node)) for node in islice(finder.slow(piece), 1)]
            ending += [Note(_ENDS, piece.place(node)) for node in islice(finder.ending(piece), 1)]
    return tuple(slow[:_MOST_SHOWN]), tuple(ending)


class _Finder:
    """Find what is not quick in pieces; the document `is_unclear` if names may mean what they do not say."""

    def __init__(self, effects: CodeEffects) -> None:
        analysis, document = effects.analysis, effects.analysis.document
        self._definitions, self._effects = effects.definitions, effects
        nodes = [*dict.fromkeys(each for piece in analysis.pieces for each in all_nodes(piece.tree))]
        given = _given(document)
        of_class = {each for piece in analysis.functions for each in own_nodes(piece.tree)}
        bound = {name for each in nodes if not isinstance(each, ast.alias) for name in binds(each)}
        arguments = {each for each in nodes if isinstance(each, ast.arg)}
        self._bound = {*given, *bound, *(each.arg for each in arguments), "event"} - {"self"}
        self._modules = names_with(analysis.libraries, nodes)
        self._declared = {ast.unparse(each.node) for each in analysis.imports}
        methods = [each for each in of_class if isinstance(each, ast.FunctionDef) and not is_static(each)]
        selves = {each for each in arguments if each.arg == "self"} - {
            one for each in methods for one in each.args.args[:1]
        }
        roots = {each.partition(".")[0] for each in self._modules.values()} - {"interfaces"}
        files = {f"{root}{end}" for root in roots for end in (".py", "/__init__.py")}
        beside = [path / file for path in (analysis.path.parent, analysis.output) if path for file in files]
        is_replaced = any(each.exists() for each in beside)
        self.is_unclear = is_replaced or bool(selves) or "*" in self._modules or "self" in bound
        attributes = [each for each in nodes if isinstance(each, ast.Attribute)]
        stored = {each.attr for each in attributes if not isinstance(each.ctx, ast.Load)}
        self._own = analysis.defined | stored
        proxies = {each.name for each in (*document.all_interfaces, *document.ros)}
        aliases = {*document.proxy_aliases, *document.ros_aliases}
        self._reserved = proxies | aliases | COMPONENT_ATTRIBUTES
        self._attributes = (
            self._reserved - {"automaton", "sleep"} | self._own | {each.name for each in document.parameters}
        )
        self._proxies = proxies - self._own
        self._values = Values(nodes, of_class, given, self.full, self._asks)
        classes = {each.name for each in nodes if isinstance(each, ast.ClassDef) and each not in of_class}
        self._classes = {each for each in classes if self._values.given(each) == [None]}
        self._called = {each.func for each in nodes if isinstance(each, ast.Call)}
        self._parts = self._called | {each.value for each in attributes}
        self._work: dict[str, float] = {}
        self._has_threads = "threading" in roots
        self._sizes = {each: _size(each, analysis.path.parent) for each in nodes if self._calls(each, "open")}
        entered = {each.context_expr for each in nodes if isinstance(each, ast.withitem)}
        loaded = {each for each in nodes if isinstance(getattr(each, "ctx", None), ast.Load)}
        self._read = {last_name(each) for each in loaded - entered}
        self._later = [
            each for each in nodes if isinstance(each, _LATER) or self._calls(each, "filter", "map")
        ]
        inner = [each for each in nodes if isinstance(each, ast.Nonlocal | ast.NamedExpr)]
        self._set_elsewhere = {name for one in inner for each in ast.walk(one) for name in binds(each)}

    def full(self, node: ast.AST) -> str:
        """Return the full name of something of Python, of a library or of the component; else nothing."""
        first, *others = dotted(node) or [""]
        full = "" if first in self._bound else ".".join([self._modules.get(first, first), *others])
        return "" if full.startswith("?") else full

    def _calls(self, node: ast.AST | None, *names: str) -> bool:
        return isinstance(node, ast.Call) and self.full(node.func) in names

    def ending(self, piece: Piece) -> Iterator[ast.AST]:
        """Yield the nodes of a piece of code that may end the component."""
        return (each for each in all_nodes(piece.tree) if lasts(self.full(each)) is Lasts.ENDS)

    def slow(self, piece: Piece) -> Iterator[ast.AST]:
        """Yield the nodes of a piece of code that are not certainly quick."""
        for node in all_nodes(piece.tree):
            if isinstance(node, _OTHER_FORMS) or self._is_slow(node) or self._values.grows(node):
                yield node
        if self._work_of(piece.tree) > _MOST_WORK:
            yield piece.tree.body[0]

    def _is_quick(self, full: str) -> bool:
        return lasts(full) in (Lasts.QUICK, Lasts.ENDS)

    def _is_slow(self, node: ast.AST) -> bool:
        match node:
            case ast.Name(id=name, ctx=ast.Load()):
                return _is_hidden(name) or (node not in self._parts and not self._is_known(node))
            case ast.Attribute():
                return self._is_slow_attribute(node)
            case ast.Call():
                return not (self._asks(node) or self._is_quick_call(node))
            case ast.FunctionDef(name=name, decorator_list=decorators):
                return _is_hidden(name) or not self._are_all_in(decorators, DECORATORS)
            case ast.ClassDef(body=body, bases=bases, keywords=keywords, decorator_list=decorators):
                are_known = self._are_all_in(decorators, {"dataclasses.dataclass"}) and self._are_all_in(
                    bases, BASES
                )
                return bool(keywords) or not are_known or not all(map(_is_constant, body))
            case ast.With(items=items, body=body):
                return len(items) != 1 or not self._is_quick_context(items[0].context_expr, body)
            case ast.While():
                return self._rounds(node) == inf
            case ast.Import(names=names):
                is_there = ast.unparse(node) in self._declared
                return not is_there and not {each.name for each in names} <= LOADED
            case ast.ImportFrom(module=module, names=names):
                is_there = ast.unparse(node) in self._declared or module in LOADED
                return not is_there or not all(self._is_quick(f"{module}.{each.name}") for each in names)
            case ast.Subscript(slice=index):  # a new axis multiplies what arrays have
                return any(isinstance(each, ast.Constant) and each.value is None for each in ast.walk(index))
            case ast.FormattedValue(format_spec=ast.JoinedStr(values=parts)):
                return any(re.search(r"\d{3}|Formatted", ast.dump(each)) for each in parts)
            case ast.Constant(value=int(number)):
                return abs(number) > _LARGEST
            case ast.Constant(value=str(text)):
                return bool(_WIDE.search(text))
            case ast.MatchClass(kwd_attrs=names):
                return any(map(_is_hidden, names))
        return False

    def _are_all_in(self, nodes: list[ast.expr], names: frozenset[str] | set[str]) -> bool:
        return {self.full(each.func if isinstance(each, ast.Call) else each) for each in nodes} <= names

    def _is_known(self, node: ast.expr) -> bool:
        """Return whether a name is one of the document or in the table, or an attribute of what is."""
        first, *_ = dotted(node)
        while isinstance(node, ast.Attribute) and not self._is_quick(self.full(node)):
            node = node.value
        is_missing = first not in self._modules and not self._definitions.outside(first)
        return first in self._bound | {"self"} or self._is_quick(self.full(node)) or is_missing

    def _is_slow_attribute(self, node: ast.Attribute) -> bool:
        path, name = dotted(node), node.attr
        is_of_self = path[:-1] == ["self"]
        if _is_hidden(name):
            return True
        if not isinstance(node.ctx, ast.Load):
            is_own = bool(path) and path[0] in self._bound | {"self"} and self._reserved.isdisjoint(path)
            return not is_own or (name in QUICK_METHODS and not is_of_self)
        if is_of_self:
            return node not in self._called and not (name in self._attributes or self._is_missing(name))
        return bool(path) and node not in self._parts and not self._is_known(node)

    def _is_missing(self, name: str) -> bool:
        """Return whether to name an attribute of the component is an error."""
        return name not in self._attributes and not self._definitions.declared(name)

    def _asks(self, call: ast.Call) -> bool:
        """Return whether a call certainly is one of an operation of a servant."""
        match call.func:
            case ast.Attribute(attr=name) if name.startswith("ice_") or "Cast" in name:
                return False
            case ast.Attribute(value=ast.Call() as owner) if self._gets_proxy(owner):
                return True
        path = self.full(call.func).split(".")
        is_one = len(path) == 3 and path[0] == "self" and path[1] in self._proxies
        return is_one or self._effects.called_kinds.get(call, frozenset()) == {"operation"}

    def _gets_proxy(self, call: ast.Call) -> bool:
        """Return whether a call is as `getattr(self, f"{side}Motors")`, and gets proxies alone."""
        match call:
            case ast.Call(ast.Name("getattr"), [ast.Name("self"), ast.JoinedStr([first, *_, last])]):
                start, end = (
                    str(getattr(each, "value", "")) * isinstance(each, ast.Constant) for each in (first, last)
                )
                names = {each for each in self._effects.names_of_component() if each.startswith(start)}
                found = {each for each in names if each.endswith(end)}
                return bool(start or end) and found <= self._definitions.proxies - self._own
        return False

    def _is_quick_call(self, call: ast.Call) -> bool:
        function, full, name = call.func, self.full(call.func), last_name(call.func)
        kinds = self._effects.called_kinds.get(call, frozenset())
        if lasts(full) is Lasts.ENDS or kinds == {"send"}:
            return True
        if isinstance(function, ast.Name) and name in self._bound:
            return name in self._values.functions or name in self._classes
        if full == f"self{name}" or kinds == {"function"}:
            is_own = full in ("self.mark", "self.send") and self._own.isdisjoint(full.split("."))
            return name in self._values.functions or is_own or self._is_missing(name[1:])
        if self._is_quick(full):
            return self._own.isdisjoint(full.split(".")[1:]) and self._is_quick_function(call, full)
        is_object = isinstance(function, ast.Attribute) and (
            not dotted(function) or self._is_known(function.value)
        )
        return is_object and name[1:] in QUICK_METHODS and self._is_quick_function(call, name)

    def _is_quick_function(self, call: ast.Call, full: str) -> bool:
        """Return whether something of the table is quick with these arguments, and calls only what is."""
        given, named = call.args, {each.arg: each.value for each in call.keywords}
        called = [*(value for key, value in named.items() if key in ("function", "key", "target"))]
        called += given[:1] if full in ("filter", "map") else []
        is_spread = any(isinstance(each, ast.Starred) for each in given)
        if None in named or (called and is_spread) or not all(map(self._may_be_called, called)):
            return False
        match full:
            case "print":
                return "file" not in named
            case "round" | "json.dumps":
                return (len(given) == 1 and not named) or isinstance(given[-1], ast.Constant)
            case "getattr" | "hasattr":
                name = getattr(given[1], "value", "__") if len(given) > 1 and not is_spread else "__"
                return self._gets_proxy(call) or (isinstance(name, str) and not _is_hidden(name))
            case "open":
                return self._sizes[call] <= _LARGEST
            case ".join":  # of a text, not of a thread
                owner = getattr(call.func, "value", None)
                return isinstance(owner, ast.Constant | ast.JoinedStr) or not self._has_threads
            case "threading.Thread":
                return not given
            case "pathlib.Path" | "numpy.ones" | "numpy.zeros":
                inside = [each for one in given[:1] for each in ast.walk(one) if isinstance(each, ast.expr)]
                sizes = [getattr(each, "value", 1) for each in inside]
                is_small = prod(each for each in sizes if isinstance(each, int)) <= _LARGEST
                return is_small and all(isinstance(each, ast.Constant | ast.Tuple) for each in inside)
            case ".reshape":
                return not any(
                    isinstance(each, ast.UnaryOp) or getattr(each, "value", 3) in (1, None) for each in given
                )
        return True

    def _may_be_called(self, node: ast.expr) -> bool:
        """Return whether a function may be given to others, which call it."""
        full, name = self.full(node), last_name(node)
        is_own = name in self._values.functions and (isinstance(node, ast.Name) or full == f"self{name}")
        return is_own or isinstance(node, ast.Lambda | ast.Constant) or full in CALLED

    def _is_quick_context(self, context: ast.expr, body: list[ast.stmt]) -> bool:
        """Return whether `with` enters a file, or a lock that is held while nothing enters another one."""
        locks, running = self._values.given(last_name(context)), self._values.running([*body, *self._later])
        is_lock = bool(locks) and all(self._calls(each, *LOCKS) for each in locks)
        is_free = last_name(context) not in self._read and not any(
            isinstance(each, ast.With | ast.Yield | ast.YieldFrom) for each in running
        )
        return context in self._sizes or (is_lock and is_free)

    def _rounds(self, loop: ast.While) -> float:
        """Return how often a loop turns that counts up to a number; infinite for all others."""
        match loop.test:
            case ast.Compare(ast.Name(name), [ast.Lt() | ast.LtE()], [ast.Constant() | ast.Name() as end]):
                inside = [*ast.walk(loop)]
                is_set_once = (
                    sum(name in binds(each) for each in inside) == 1 and name not in self._set_elsewhere
                )
                counts = is_set_once and all(_counts(each, name) for each in self._values.given(name))
                skips = any(isinstance(each, ast.Continue) for each in inside)
                if counts and not skips and any(_raises(each, name) for each in loop.body):
                    return self._number(end) + 2
        return inf

    def _work_of(self, node: ast.AST, around: frozenset[str] = frozenset()) -> float:
        """Return how many nodes code runs through at most, with the functions that it names."""
        if isinstance(node, ast.FunctionDef):  # what it does is done where it is named
            return 1
        found = 1 + sum(self._work_of(each, around) for each in child_nodes(node))
        match node:
            case ast.Name() | ast.Attribute() | ast.Constant(value=str()):
                name = named(node)
                if name in around:
                    return inf  # it calls itself
                if name in self._values.functions and name not in self._work:
                    bodies = [each.body for each in self._values.functions[name]]
                    nodes = [each for body in bodies for each in (body if isinstance(body, list) else [body])]
                    self._work[name] = sum(self._work_of(each, around | {name}) for each in nodes)
                return found + self._work.get(name, 0)
            case ast.For(iter=through, body=body):
                is_endless = self._values.changes(body) and not self._is_copy(through)
                is_doubled = self._values.multiplies(through, body)
                return inf if is_endless or is_doubled else found * self._turns(through)
            case ast.While():
                return found * self._rounds(node)
            case ast.ListComp() | ast.SetComp() | ast.GeneratorExp() | ast.DictComp():
                turns = prod(self._turns(each.iter) for each in node.generators)
                return inf if self._values.changes([node]) else found * turns
            case ast.Call(func=function, keywords=keywords):
                full = self.full(function)
                if full in ("filter", "map") or any(each.arg == "key" for each in keywords):
                    return inf if self._values.changes([node]) else found * _TURNS
                return found + (self._turns(node) if full == "range" else 0)
        return found

    def _turns(self, through: ast.expr) -> float:
        """Return how often a loop turns that goes through something."""
        match through:
            case ast.List(elts=parts) | ast.Tuple(elts=parts) | ast.Set(elts=parts):
                return max(1, len(parts))
            case ast.Call(func=ast.Name("range"), args=given):
                return max(1, max(map(self._number, given[:2]), default=inf))
        if self._values.come_from(through, _PICTURES):
            return inf
        is_of_file = self._values.come_from(through, ("open",))
        return max(_TURNS, max(self._sizes.values(), default=0) if is_of_file else 0)

    def _number(self, node: ast.expr | None) -> float:
        """Return how large a number is at most; infinite if nothing says that."""
        match node:
            case ast.Constant(value=int(number)):
                return abs(number)
            case ast.Call(func=ast.Name("len"), args=[of]):
                return self._turns(of)
            case ast.BinOp(left=left, op=ast.Add() | ast.Sub() | ast.FloorDiv(), right=right):
                return self._number(left) + self._number(right)
            case ast.Name(id=name) if all(
                isinstance(each, ast.Constant) for each in self._values.given(name)
            ):
                return max(map(self._number, self._values.given(name)), default=inf)
        return inf

    def _is_copy(self, node: ast.expr) -> bool:
        """Return whether an iterable is new, spelled out, or a text: no other name has it."""
        match node:
            case ast.Call(func=function):
                full = self.full(function)
                return full in _COPIES or full.startswith("cv2.") or self._asks(node)
            case ast.Subscript(value=value) | ast.Attribute(value=value):
                return isinstance(getattr(node, "slice", None), ast.Slice) or self._is_copy(value)
            case ast.List(elts=parts) | ast.Tuple(elts=parts) | ast.Set(elts=parts):
                return not any(isinstance(each, ast.Starred) for each in parts)
        return isinstance(node, ast.Constant)


def _given(document: Document) -> dict[str, ast.expr | None]:
    """Return the parameters, and what automata take and give; numbers with a point are only the former's."""
    exchanged = {each.name for one in document.automata for each in (*one.inputs, *one.outputs)}
    results = {each.variable.text.strip() for _, state in document.states() for each in state.results}
    floats = {f".{each.name}": each.type.text.strip() == "float" for each in document.parameters}
    return {
        **dict.fromkeys(exchanged | results),
        **{name: ast.Constant(0.0 if is_float else 0) for name, is_float in floats.items()},
    }


def _size(call: ast.AST, folder: Path) -> float:
    """Return the bytes of a regular file that a call of `open` opens to read it; infinite for all others."""
    match call:
        case ast.Call(_, [ast.Constant(str(name)), *others], options):
            modes = [*others, *(each.value for each in options if each.arg == "mode")]
            is_read = all(getattr(each, "value", None) in ("r", "rb", "rt") for each in modes)
            are_known = {each.arg for each in options} <= {"encoding", "errors", "mode", "newline"}
            try:
                path = (folder / name).resolve(strict=True)
                found = path.stat()
            except (OSError, ValueError, RuntimeError):
                return inf
            is_regular = stat.S_ISREG(found.st_mode) and path.parts[1] not in ("dev", "proc", "sys")
            return float(found.st_size) if is_read and are_known and is_regular else inf
    return inf


def _raises(node: ast.stmt, name: str) -> bool:
    """Return whether a statement adds something to a name that counts."""
    return (
        isinstance(node, ast.AugAssign)
        and last_name(node.target) == name
        and getattr(node.value, "value", 0) != 0
    )


def _counts(node: ast.expr | None, name: str) -> bool:
    """Return whether a value is a whole number that is spelled out, or a name plus such a number."""
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add) and last_name(node.left) == name:
        node = node.right
    return isinstance(node, ast.Constant) and isinstance(node.value, int)


def _is_constant(node: ast.stmt) -> bool:
    """Return whether a statement of a class only gives a value to a name, which no method has."""
    match node:
        case ast.Assign(targets=[ast.Name(id=name)]) | ast.AnnAssign(target=ast.Name(id=name)):
            return not _is_hidden(name) and name not in QUICK_METHODS
    return isinstance(node, ast.Pass) or (isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant))


def _is_hidden(name: str) -> bool:
    """Return whether Python gives a meaning to a name by which code reaches what it does not name."""
    return name == "modules" or (name.startswith("__") and name not in HARMLESS)
