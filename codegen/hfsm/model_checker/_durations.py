"""Find code that is not certainly quick: its cycle may last for longer than its period, or forever.

While a cycle lasts, others fall due and are missed, so that timers that expire one after the other in the
model may expire together; and what is to come may never come. Quick is what consists of the forms below and
of what the table in `_quick` has. Calls of servants are taken to end within a period.

Where all code is quick, no object but those that the table makes is anywhere: hence operators, attributes and
loops are as quick as theirs are. One place that is not makes the whole document slow.
"""

from __future__ import annotations

import ast
import re
import stat
from collections.abc import Iterator
from math import inf, prod
from typing import Final

from ...diagnostics import Location, Note
from ...messages import Message
from .._definitions import is_static
from .._effects import CodeEffects
from .._possible_values import HARMLESS
from ..analysis import Piece, names_with
from ..code.names import COMPONENT_ATTRIBUTES
from ..code.text import all_nodes, binds, child_nodes, dotted, own_nodes
from ._growth import Values, last_name
from ._quick import (
    BASES,
    CALLED,
    DECORATORS,
    ENDING,
    LOADED,
    LOCKS,
    OF_COMPONENT,
    is_quick_method,
    is_quick_name,
)

_SLOW: Final = Message("this code may take longer than a period, and timers may expire in any order")
_ENDS: Final = Message("this code may end the component")
_OTHER_FORMS: Final = (
    *(ast.AsyncFor, ast.AsyncFunctionDef, ast.AsyncWith, ast.Await, ast.MatMult, ast.LShift, ast.TryStar),
    *(each for each in (getattr(ast, name, None) for name in ("TypeAlias", "TemplateStr")) if each),
)
_MOST_SHOWN: Final = 3
_MOST_WORK: Final = 100_000
"""The most nodes of its tree that a piece of code may run through."""
_LENGTH: Final = 100
"""How long that is taken to be which is not spelled out."""
_PIXELS: Final = 1 << 20
_OF_PIXELS: Final = frozenset(
    {
        *(".array", ".asarray", ".astype", ".cvtColor", ".flatten", ".frombuffer", ".inRange", ".reshape"),
        ".tolist",
    }
)
"""What gives the parts of pictures."""
_LARGEST: Final = 1 << 20
"""The largest whole number that code may name, and the largest file that it may read, in bytes."""
_LONG_FORMAT: Final = re.compile(r"%[^a-zA-Z%]*(\d{3}|\*)")


def slow_code(effects: CodeEffects) -> tuple[tuple[Note, ...], tuple[Note, ...]]:
    """Return the places of code that is not certainly quick, and of code that may end the component.

    There is at most one for each piece of code, and few of code that is not quick: one is enough for all.
    """
    extension, finder = effects.analysis.extension, _Finder(effects)
    slow: list[Note] = []
    ending: list[Note] = []
    if extension is not None and not extension.problem:
        slow.append(Note(_SLOW, Location(extension.path)))
    for text, path, piece in effects.analysis.by_text.values():
        if piece is not None and piece.is_deep:
            slow.append(Note(_SLOW, Location(path, max(1, text.line), max(1, text.column))))
        elif piece is not None:  # otherwise the component cannot be generated
            for notes, message, found in (
                (slow, _SLOW, finder.slow(piece)),
                (ending, _ENDS, finder.ending(piece)),
            ):
                notes.extend(Note(message, piece.place(node)) for node in [next(found, None)] if node)
    return tuple(slow[:_MOST_SHOWN]), tuple(ending)


class _Finder:
    def __init__(self, effects: CodeEffects) -> None:
        analysis, document = effects.analysis, effects.analysis.document
        self._effects, self._path = effects, analysis.path
        self._nodes = {piece: _without_annotations(piece.tree) for piece in analysis.pieces}
        nodes = [*dict.fromkeys(node for of_one in self._nodes.values() for node in of_one)]
        declared = _declared(effects)
        of_class = {each for piece in analysis.functions for each in own_nodes(piece.tree)}
        bound = {name for each in nodes if not isinstance(each, ast.alias) for name in binds(each)}
        self._bound = (
            {*declared} | bound | {each.arg for each in nodes if isinstance(each, ast.arg)} | {"event"}
        )
        self._bound -= {"self"}
        methods = [each for each in of_class if isinstance(each, ast.FunctionDef) and not is_static(each)]
        own = {each.args.args[0] for each in methods if each.args.args}
        arguments = {each for each in nodes if isinstance(each, ast.arg) and each.arg == "self"}
        self._has_other_self = "self" in bound or not arguments <= own
        self._modules = names_with(analysis.libraries, nodes)
        self._declared = {ast.unparse(each.node) for each in analysis.imports}
        roots = {each.partition(".")[0] for each in self._modules.values()} - {"interfaces"}
        folders = {self._path.parent, analysis.output or self._path.parent}
        self._replaced = {
            each
            for each in roots
            for folder in folders
            if (folder / f"{each}.py").exists() or (folder / each / "__init__.py").exists()
        }
        """Modules that files beside the document take the place of."""
        attributes = (each for each in nodes if isinstance(each, ast.Attribute))
        stored = {each.attr for each in attributes if not isinstance(each.ctx, ast.Load)}
        self._own = analysis.defined | stored
        proxies = {each.name for each in (*document.all_interfaces, *document.ros)}
        self._reserved = proxies | {*document.proxy_aliases, *document.ros_aliases} | COMPONENT_ATTRIBUTES
        self._attributes = self._reserved | self._own | {each.name for each in document.parameters}
        self._attributes -= {"automaton", "sleep"} - self._own
        self._proxies = proxies - self._own
        self._values = Values(nodes, of_class, declared, self.full, self._asks)
        self._classes = {
            each.name for each in nodes if isinstance(each, ast.ClassDef) and each not in of_class
        }
        self._classes = {each for each in self._classes if self._values.given[each] == [None]}
        self._called = {each.func for each in nodes if isinstance(each, ast.Call)}
        self._parts = self._called | {each.value for each in nodes if isinstance(each, ast.Attribute)}
        texts = (each.value for each in nodes if isinstance(each, ast.Constant))
        self._has_long_format = any(isinstance(each, str) and _LONG_FORMAT.search(each) for each in texts)
        self._has_threads = any(self.full(each).startswith("threading.T") for each in self._parts)
        self._work: dict[str, float] = {}

    def full(self, node: ast.AST) -> str:
        """Return the full name of something of Python, of a library or of the component; else nothing."""
        first, *others = dotted(node) or [""]
        star = self._modules.get("*", "")
        if first in self._bound or (first == "self" and self._has_other_self):
            return ""
        if star and first != "self" and first not in self._modules:
            first = f"{star[:-1]}{first}" if is_quick_name(f"{star[:-1]}{first}") else first
            if star.partition(".")[0] not in ("cmath", "interfaces", "math"):
                return ""
        full = ".".join([self._modules.get(first, first), *others])
        return "" if full.startswith("?") or full.partition(".")[0] in self._replaced else full

    def ending(self, piece: Piece) -> Iterator[ast.AST]:
        """Yield the nodes of a piece of code that may end the component."""
        return (each for each in self._nodes[piece] if self.full(each) in ENDING)

    def slow(self, piece: Piece) -> Iterator[ast.AST]:
        """Yield the nodes of a piece of code that are not certainly quick."""
        for node in self._nodes[piece]:
            if isinstance(node, _OTHER_FORMS) or self._is_slow(node):
                yield node
        if self._work_of(piece.tree) > _MOST_WORK:
            yield piece.tree.body[0]

    def _is_slow(self, node: ast.AST) -> bool:
        match node:
            case ast.Name(id=name, ctx=ast.Load()):
                return _is_hidden(name) or (node not in self._parts and not self._is_known(node))
            case ast.Attribute():
                return self._is_slow_attribute(node)
            case ast.Call():
                is_asked = self._asks(node)
                is_slow = not (is_asked or self._is_quick_call(node)) or self._values.extends_itself(node)
                return is_slow or (not is_asked and self._values.explodes(node))
            case ast.FunctionDef(name=name, decorator_list=decorators):
                found = {self.full(each.func if isinstance(each, ast.Call) else each) for each in decorators}
                return _is_hidden(name) or not found <= DECORATORS
            case ast.ClassDef(body=body, bases=bases, keywords=keywords, decorator_list=decorators):
                found = {self.full(each.func if isinstance(each, ast.Call) else each) for each in decorators}
                are_known = {self.full(each) for each in bases} <= BASES and found <= {
                    "dataclasses.dataclass"
                }
                return bool(keywords) or not are_known or not all(map(_is_constant, body))
            case ast.With(items=items):
                return len(items) != 1 or not self._is_quick_context(items[0].context_expr, node)
            case ast.While():
                return self._rounds(node) == inf
            case ast.Import(names=names):
                is_there = ast.unparse(node) in self._declared
                return not is_there and not {each.name for each in names} <= LOADED - self._replaced
            case ast.ImportFrom(module=module, names=names):
                full = {f"{module}.{each.name}" for each in names}
                is_there = ast.unparse(node) in self._declared or module in LOADED - self._replaced
                return not is_there or not all(is_quick_name(each) or each in ENDING for each in full)
            case ast.Subscript(slice=index):  # a new axis multiplies what arrays have
                return any(isinstance(each, ast.Constant) and each.value is None for each in ast.walk(index))
            case ast.FormattedValue(format_spec=ast.JoinedStr(values=parts)):
                texts = [each.value if isinstance(each, ast.Constant) else "999" for each in parts]
                return any(re.search(r"\d{3}", str(each)) for each in texts)
            case ast.Constant(value=int(number)):
                return abs(number) > _LARGEST
            case ast.MatchClass(kwd_attrs=names):
                return any(map(_is_hidden, names))
            case ast.BinOp(op=ast.Mod()) | ast.AugAssign(op=ast.Mod()) if self._has_long_format:
                return True
        return self._values.explodes(node) or self._values.extends_itself(node)

    def _is_known(self, node: ast.expr) -> bool:
        """Return whether a name is one of the document or in the table, or an attribute of what is."""
        first, *_ = dotted(node)
        while isinstance(node, ast.Attribute) and not is_quick_name(self.full(node)):
            node = node.value
        is_missing = not self._effects.definitions.outside(first)  # to name it is an error
        is_known = is_quick_name(self.full(node)) or self.full(node) in ENDING
        return is_known or first in self._bound | {"self"} or (is_missing and first not in self._modules)

    def _is_slow_attribute(self, node: ast.Attribute) -> bool:
        path, name = dotted(node), node.attr
        if _is_hidden(name):
            return True
        if isinstance(node.ctx, ast.Load):
            if path[:-1] == ["self"]:
                return node not in self._called and not (name in self._attributes or self._is_missing(name))
            return bool(path) and node not in self._parts and not self._is_known(node)
        if path[:-1] == ["self"]:
            return name in self._reserved
        is_own = bool(path) and path[0] in self._bound | {"self"} and self._reserved.isdisjoint(path)
        return not is_own or is_quick_method(name)

    def _is_missing(self, name: str) -> bool:
        """Return whether to name an attribute of the component is an error."""
        return name not in self._attributes and not self._effects.definitions.declared(name)

    def _asks(self, call: ast.Call) -> bool:
        """Return whether a call certainly is one of an operation of a servant."""
        owner = call.func.value if isinstance(call.func, ast.Attribute) else None
        kinds = self._effects.called_kinds.get(call, frozenset())
        match owner:
            case ast.Call(
                func=ast.Name("getattr"), args=[ast.Name("self"), ast.JoinedStr(values=[first, *_, last])]
            ):
                start, end = (
                    str(each.value) if isinstance(each, ast.Constant) else "" for each in (first, last)
                )
                names = {each for each in self._effects.names_of_component() if each.startswith(start)}
                found = {each for each in names if each.endswith(end)}
                return bool(start or end) and found <= self._effects.definitions.proxies - self._own
        if last_name(call.func).startswith(".ice_") or "Cast" in last_name(call.func):
            return False
        path = self.full(call.func).split(".")
        return kinds == {"operation"} or (len(path) == 3 and path[0] == "self" and path[1] in self._proxies)

    def _is_quick_call(self, call: ast.Call) -> bool:
        function, full, name = call.func, self.full(call.func), last_name(call.func)
        kinds = self._effects.called_kinds.get(call, frozenset())
        if full in ENDING or kinds == {"send"}:
            return True
        if isinstance(function, ast.Name) and name in self._bound:
            return name in self._values.functions or name in self._classes
        if name in self._values.functions and (full == f"self{name}" or kinds == {"function"}):
            return True
        if full.removeprefix("self.") in OF_COMPONENT:
            return full.startswith("self.") and self._own.isdisjoint(full.split("."))
        if is_quick_name(full):
            return self._is_quick_function(call, full)
        if full == f"self{name}" and self._is_missing(name[1:]):
            return True
        is_object = isinstance(function, ast.Attribute) and full != f"self{name}"
        is_object = is_object and (not dotted(function) or self._is_known(function.value))  # type: ignore[attr-defined]
        return is_object and is_quick_method(name[1:]) and self._is_quick_function(call, name)

    def _is_quick_function(self, call: ast.Call, full: str) -> bool:
        """Return whether something of the table is quick with these arguments, and calls only what is."""
        given, named = call.args, {each.arg: each.value for each in call.keywords}
        called = [value for key, value in named.items() if key in ("function", "key", "target")]
        called += given[:1] if full in ("filter", "map") else given[1:2] if full == "threading.Timer" else []
        is_spread = any(isinstance(each, ast.Starred) for each in given)
        if None in named or (called and is_spread) or not all(map(self._may_be_called, called)):
            return False
        match full:
            case "print":
                return "file" not in named
            case "iter" | "type":
                return len(given) == 1
            case "round" | "json.dumps":
                return (len(given) == 1 and not named) or isinstance(given[-1], ast.Constant)
            case "getattr" | "hasattr":
                asked = self._values.parents.get(self._values.parents.get(call, call), call)
                is_proxy = isinstance(asked, ast.Call) and asked is not call and self._asks(asked)
                name = given[1].value if len(given) > 1 and isinstance(given[1], ast.Constant) else "__"
                return is_proxy or (not _is_hidden(str(name)) and not is_spread)
            case "open":
                return self._is_file(given, named)
            case "pathlib.Path" | "numpy.ones" | "numpy.zeros":
                inside = [each for one in given[:1] for each in ast.walk(one) if isinstance(each, ast.expr)]
                sizes = [each.value for each in inside if isinstance(each, ast.Constant)]
                is_small = prod(each for each in sizes if isinstance(each, int)) <= _LARGEST
                return is_small and all(isinstance(each, ast.Constant | ast.Tuple) for each in inside)
            case "threading.Thread":
                return not given
            case ".join":  # of a thread, not of a text
                owner = call.func.value if isinstance(call.func, ast.Attribute) else None
                return isinstance(owner, ast.Constant | ast.JoinedStr) or not self._has_threads
            case ".reshape":
                return not any(
                    isinstance(each, ast.UnaryOp) or getattr(each, "value", 3) in (1, None) for each in given
                )
        return True

    def _may_be_called(self, node: ast.expr) -> bool:
        """Return whether a function may be given to others, which call it."""
        if isinstance(node, ast.Lambda | ast.Constant) or self.full(node) in CALLED:
            return True
        is_own = isinstance(node, ast.Name) or self.full(node) == f"self{last_name(node)}"
        return is_own and last_name(node) in self._values.functions

    def _is_file(self, given: list[ast.expr], named: dict[str | None, ast.expr]) -> bool:
        """Return whether a call opens a regular file that is there, to read it."""
        match given, [*given[1:2], *([named.pop("mode")] if "mode" in named else [])]:
            case [ast.Constant(value=str(name)), *_], [] | [ast.Constant(value="r" | "rb" | "rt")]:
                try:
                    path = (self._path.parent / name).resolve(strict=True)
                    found = path.stat()
                except (OSError, ValueError, RuntimeError):
                    return False
                is_known = len(given) < 3 and named.keys() <= {"encoding", "errors", "newline"}
                is_regular = stat.S_ISREG(found.st_mode) and found.st_size <= _LARGEST
                return is_known and is_regular and not f"{path}".startswith(("/dev/", "/proc/", "/sys/"))
        return False

    def _is_quick_context(self, context: ast.expr, block: ast.With) -> bool:
        """Return whether `with` enters a file, or a lock that is held while nothing else is taken."""
        if isinstance(context, ast.Call):
            return self.full(context.func) == "open"
        values, name = self._values.given.get(last_name(context), ()), last_name(context)
        is_lock = bool(values) and all(
            isinstance(each, ast.Call) and self.full(each.func) in LOCKS for each in values
        )
        are_blocks = all(
            isinstance(self._values.parents[each], ast.withitem) for each in self._values.uses[name]
        )
        inside = [each for one in block.body for each in ast.walk(one)]
        calls = {last_name(each) for each in inside} & self._values.functions.keys()
        return is_lock and are_blocks and not calls and not any(isinstance(each, ast.With) for each in inside)

    def _rounds(self, loop: ast.While) -> float:
        """Return how often a loop runs at most that counts up to a number; infinite for all others."""
        match loop.test:
            case ast.Compare(
                left=ast.Name(id=name), ops=[ast.Lt() | ast.LtE()], comparators=[ast.Constant(value=int(end))]
            ):
                steps = [
                    each
                    for each in loop.body
                    if isinstance(each, ast.AugAssign) and last_name(each.target) == name
                ]
                inside = [each for each in ast.walk(loop) if name in binds(each)]
                everywhere = [each for nodes in self._nodes.values() for each in nodes]
                is_shared = any(
                    name in each.names for each in everywhere if isinstance(each, ast.Global | ast.Nonlocal)
                )
                is_left = any(
                    isinstance(each, ast.Continue | ast.FunctionDef | ast.Lambda) for each in ast.walk(loop)
                )
                if len(steps) == len(inside) == 1 and not is_shared and not is_left:
                    are_counts = all(_counts(each, name) for each in self._values.given[name])
                    if are_counts and _counts(
                        ast.BinOp(steps[0].target, steps[0].op, steps[0].value), name, 1
                    ):
                        return max(end, 0) + 1001
        return inf

    def _work_of(self, node: ast.AST, around: frozenset[str] = frozenset()) -> float:
        """Return how many nodes code runs through at most, with the functions that it names."""
        if isinstance(node, ast.FunctionDef):  # what it does is done where it is named
            return 1
        found = 1 + sum(self._work_of(each, around) for each in child_nodes(node))
        match node:
            case ast.Name() | ast.Attribute() | ast.Constant(value=str()):
                name = f".{node.value!s}" if isinstance(node, ast.Constant) else last_name(node)
                return found + (self._work_of_function(name, around) if name in self._values.functions else 0)
            case ast.For(iter=through):
                bodies = [each for each in child_nodes(node) if each is not through]
                inside = sum(self._work_of(each, around) for each in bodies)
                return 1 + self._work_of(through, around) + inside * self._length(through)
            case ast.While():
                return found * self._rounds(node)
            case ast.ListComp() | ast.SetComp() | ast.GeneratorExp() | ast.DictComp():
                return found * prod(self._length(each.iter) for each in node.generators)
            case ast.Call(func=function) if self.full(function) == "range":
                return found + self._length(node)
            case ast.Call(func=function, keywords=keywords) if self.full(function) in (
                "filter",
                "map",
            ) or any(each.arg == "key" for each in keywords):
                return found * _LENGTH
        return found

    def _work_of_function(self, name: str, around: frozenset[str]) -> float:
        if name in around:
            return inf  # it calls itself
        if name not in self._work:
            bodies = [each.body for each in self._values.functions[name]]
            nodes = [each for body in bodies for each in (body if isinstance(body, list) else [body])]
            self._work[name] = sum(self._work_of(each, around | {name}) for each in nodes)
        return self._work[name]

    def _length(self, node: ast.expr) -> float:
        """Return how long something is that a loop goes through."""
        match node:
            case ast.List(elts=parts) | ast.Tuple(elts=parts) | ast.Set(elts=parts):
                return max(1, len(parts))
            case ast.Call(func=ast.Name("range"), args=given):
                return max((self._number(each) for each in given[:2]), default=inf)
        return _PIXELS if self._is_of_pixels(node, 3) else _LENGTH

    def _is_of_pixels(self, node: ast.AST | None, depth: int) -> bool:
        """Return whether something may be the parts of a picture."""
        match node:
            case ast.Attribute(attr="pixelData"):
                return True
            case ast.Call(
                func=ast.Name("enumerate" | "iter" | "list" | "map" | "reversed" | "sorted" | "zip"),
                args=given,
            ):
                return any(self._is_of_pixels(each, depth) for each in given)
            case ast.Call(func=function):
                return last_name(function) in _OF_PIXELS
            case ast.Subscript(value=value) | ast.Attribute(value=value) if (
                last_name(node) not in self._values.given
            ):
                return self._is_of_pixels(value, depth)
        return depth > 0 and any(
            self._is_of_pixels(each, depth - 1)
            for each in self._values.given.get(last_name(node or ast.Pass()), ())
        )

    def _number(self, node: ast.expr | None) -> float:
        match node:
            case ast.Constant(value=int(number)):
                return abs(number)
            case ast.Call(func=ast.Name("len")):
                return _LENGTH
            case ast.BinOp(left=left, op=ast.Add() | ast.Sub() | ast.FloorDiv(), right=right):
                return self._number(left) + self._number(right)
            case ast.Name(id=name) if all(
                isinstance(each, ast.Constant) for each in self._values.given.get(name, [None])
            ):
                return max(map(self._number, self._values.given[name]), default=inf)
        return inf


def _declared(effects: CodeEffects) -> dict[str, list[ast.expr | None]]:
    """Return the parameters, inputs, outputs and results, with the expressions that they get."""
    given: dict[str, list[ast.expr | None]] = {
        f".{each.name}": [ast.Constant(0.0 if each.type.text.strip() == "float" else 0)]
        for each in effects.analysis.document.parameters
    }
    for automaton in effects.analysis.document.automata:
        for each in (*automaton.inputs, *automaton.outputs):
            first = ast.Constant(0.0 if each.type.text.strip() == "float" else None)
            given.setdefault(each.name, []).append(first)
        for state in automaton.states:
            for argument in state.arguments:
                piece = effects.analysis.piece(argument.value)
                given.setdefault(argument.name, []).append(piece.expression if piece else None)
            for result in state.results:
                given.setdefault(result.variable.text.strip(), []).append(ast.Name(result.name, ast.Load()))
    return given


def _without_annotations(tree: ast.AST) -> tuple[ast.AST, ...]:
    """Return the nodes of a tree that run."""
    annotations = {
        inner
        for each in all_nodes(tree)
        for found in (getattr(each, "annotation", None), getattr(each, "returns", None))
        if found is not None
        for inner in ast.walk(found)
    }
    return tuple(each for each in all_nodes(tree) if each not in annotations)


def _is_constant(node: ast.stmt) -> bool:
    """Return whether a statement of a class only gives a value to a name, which no method has."""
    match node:
        case ast.Assign(targets=[ast.Name(id=name)]) | ast.AnnAssign(target=ast.Name(id=name)):
            return not _is_hidden(name) and not is_quick_method(name)
    return isinstance(node, ast.Pass) or (isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant))


def _counts(node: ast.expr | None, name: str, least: int = 0) -> bool:
    """Return whether a value is a number that is not very small, or a name and a number."""
    match node:
        case ast.BinOp(left=ast.Name(id=same), op=ast.Add(), right=ast.Constant(value=int(number))):
            return same == name and number >= least
        case ast.Constant(value=int()):
            return least == 0
    return False


def _is_hidden(name: str) -> bool:
    """Return whether Python gives a meaning to a name by which code reaches what it does not name."""
    return name == "modules" or (name.startswith("__") and name not in HARMLESS)
