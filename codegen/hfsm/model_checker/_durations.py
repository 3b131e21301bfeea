"""Find code that may take longer than a period: it sleeps, waits, or cannot be followed.

While a cycle lasts, others fall due and are missed, so that timers that expire one after the other in the
model may expire together. What only computes, and calls of servants, are taken to end within a period.
"""

from __future__ import annotations

import ast
from collections.abc import Collection, Iterable, Iterator, Mapping
from typing import Final

from ...diagnostics import Location, Note
from ...messages import Message
from .._definitions import FINDERS, finder_of
from .._possible_values import HARMLESS
from ..analysis import Analysis, Piece, names_with
from ..code.names import COMPONENT_ALIASES, COMPONENT_ATTRIBUTES
from ..code.text import all_nodes, dotted, full_name

_QUICK_MODULES: Final = frozenset(
    {
        *("abc", "base64", "bisect", "cmath", "collections", "colorsys", "copy", "cv2", "dataclasses"),
        *("datetime", "decimal", "enum", "fractions", "functools", "hashlib", "heapq", "interfaces"),
        *("itertools", "jderobot", "json", "logging", "math", "numpy", "operator", "random", "re"),
        *("statistics", "string", "struct", "sys", "textwrap", "threading", "time", "traceback", "types"),
        *("typing", "uuid", "weakref", "zlib"),
    }
)
"""Modules whose functions only compute. Those that wait nevertheless are found by their names."""
_QUICK_STARS: Final = frozenset({"cmath", "interfaces", "jderobot", "math", "numpy", "random"})
"""Those of which `import *` brings nothing that waits, whatever its name is."""
_QUICK_PACKAGES: Final = ("os.environ", "os.path.")
_MODULES_INSIDE: Final = frozenset({"config", "handlers", "os"})
"""Modules that wait, inside others."""
_WAITING_BUILTINS: Final = frozenset(
    {"__import__", "breakpoint", "compile", "eval", "exec", "globals", "help", "input", "locals", "vars"}
)
"""They wait for a person, or call functions that are not known."""
_WAITING_METHODS: Final = frozenset(
    {
        *("__enter__", "accept", "acquire", "communicate", "connect", "next", "put", "readline", "recv"),
        *("recvfrom", "result", "samples", "select", "wait", "wait_for"),
    }
)
_NAMED: Final = frozenset(
    {
        *("__stdin__", "acquire", "os", "pollKey", "samples", "selectROI", "selectROIs", "sleep", "stdin"),
        *("wait", "wait_for", "waitKey", "waitKeyEx"),
    }
)
"""Methods and functions that wait, found where code only names them: it may call them by another name."""
_OF_FUTURES: Final = frozenset({"exception", "next", "result"})
"""Methods that wait, found where code names them without a call; others have attributes of these names."""
_FOUND_BY_NAME: Final = frozenset({*_WAITING_METHODS, *_NAMED, *_OF_FUTURES, "join", "run"})
_GIVING_TEXTS: Final = frozenset({"filter", "list", "map", "reversed", "set", "sorted", "str", "tuple"})
_ENDLESS: Final = frozenset({"itertools.count", "itertools.cycle", "itertools.repeat"})
_CALLED: Final = _ENDLESS | {"iter", "itertools"}
"""What makes them, and their module: found where it gets another name."""
_TAKING_SOME: Final = frozenset({"itertools.islice", "next"})
_PASSING_ON: Final = frozenset({"enumerate", "iter", "map", "zip"})
"""Functions that take from an iterator only what is taken from them; all others may take from it forever."""
_SLEEP: Final = "sleep"


def slow_code(analysis: Analysis) -> tuple[Note, ...]:
    """Return the places of code that may take longer than a period, at most one for each piece of code."""
    finder = _Finder(analysis)
    found = []
    for text, path, piece in analysis.by_text.values():
        if piece is None:
            continue  # the component cannot be generated
        node = next(finder.slow(piece), None)
        if piece.is_deep:
            found.append(Note(_MESSAGE, Location(path, max(1, text.line), max(1, text.column))))
        elif node is not None:
            found.append(Note(_MESSAGE, piece.place(node)))
    return tuple(found)


_MESSAGE: Final = Message("this code may take longer than a period, and timers may expire in any order")


class _Finder:
    def __init__(self, analysis: Analysis) -> None:
        extension, document = analysis.extension, analysis.document
        nodes = [node for piece in analysis.pieces for node in all_nodes(piece.tree)]
        self._libraries = names_with(analysis.libraries, nodes)
        """The names of libraries, also of those that other code imports: it shares its names."""
        self._methods = {
            name for piece in analysis.functions for name in names_with({}, all_nodes(piece.tree))
        }
        """The names of libraries that are attributes of the component, too."""
        self._free = analysis.free
        self._has_threads = "threading" in analysis.modules
        self._has_own_sleep = _SLEEP in analysis.defined
        self._proxies = {each.name for each in document.all_interfaces}
        self._handwritten = frozenset[str]() if extension is None else extension.attributes
        self._is_open = extension is not None and extension.is_open
        """Whether hand-written code may have other attributes than those that are known."""
        given = {each.name for each in document.parameters}
        given |= {each.name for each in analysis.accesses if each.is_stored}
        self._given = given | self._proxies | analysis.defined | COMPONENT_ATTRIBUTES | COMPONENT_ALIASES
        self._endless = set[str]()
        """Names of variables and attributes that may be iterators without an end."""
        before = -1
        while before < len(self._endless):
            before = len(self._endless)
            for each in analysis.pieces:
                self._read(each)

    def _read(self, piece: Piece) -> None:
        """Note the iterators without an end to which a piece of code gives names."""
        nodes = all_nodes(piece.tree)
        modules = names_with(self._libraries, nodes)
        for targets, value in _given_names(nodes):
            if self._is_endless(value, modules):
                self._endless.update(dotted(target)[-1] for target in targets)

    def slow(self, piece: Piece) -> Iterator[ast.AST]:
        """Yield the nodes of a piece of code that may take longer than a period."""
        nodes = all_nodes(piece.tree)
        modules = names_with(self._libraries, nodes)
        called = called_in(nodes)
        parts = {node.value for node in nodes if isinstance(node, ast.Attribute)}.union(*map(_classes, nodes))
        taken = {value for _, value in _given_names(nodes)}.union(
            *(_taken_from(each, modules) for each in nodes)
        )
        for node in nodes:
            if (
                (node not in parts and self._is_foreign(node, modules))
                or self._is_slow(node, modules)
                or (node not in called | parts and self._is_named(node, modules))
                or (node not in taken and self._is_endless(node, modules))
                or hides(node, called, modules)
                or (piece.has_other_self and isinstance(node, ast.Attribute) and node.attr in _NAMED)
            ):
                yield node

    def _is_foreign(self, node: ast.AST, modules: Mapping[str, str]) -> bool:
        """Return whether a name leads to anything but a constant of a library that may wait.

        Whatever code does with it may take its time: to read an attribute, to loop over it, to call it later.
        """
        names = dotted(node)
        first = next((each for each in names if each in self._methods), names[0] if names else "")
        is_starred = "*" in modules and first in self._free
        if not isinstance(getattr(node, "ctx", None), ast.Load) or not (first in modules or is_starred):
            return False
        library = modules.get(first, modules.get("*", ""))
        return not names[-1].isupper() and _may_wait_in(".".join([library, *names[names.index(first) + 1 :]]))

    def _is_named(self, node: ast.AST, modules: Mapping[str, str]) -> bool:
        """Return whether a node that is not called names what waits, or has no end, when it is."""
        match node:
            case ast.Attribute(attr="join" | "run", value=owner):  # of a thread, not of a text spelled out
                return self._has_threads and not isinstance(owner, ast.Constant)
            case ast.Attribute(attr=name, ctx=ast.Load()) if name in _OF_FUTURES:
                return dotted(node) != ["self", name]  # what it was given was found where it got it
        return full_name(node, modules) in _CALLED

    def _is_slow(self, node: ast.AST, modules: Mapping[str, str]) -> bool:
        match node:
            case ast.While() | ast.AsyncFor() | ast.AsyncWith() | ast.Await():
                return True
            case ast.FunctionDef(name="__getitem__" | "__next__"):  # a loop over it may have no end
                return True
            case ast.With(items=items):  # a lock waits; what a library returns was found by that call
                return any(self._may_be_lock(item.context_expr, modules) for item in items)
            case ast.Constant(value="sleep" | "__getitem__" | "__next__"):  # the name of an attribute
                return True
            case ast.Attribute(value=ast.Name("self"), attr="sleep"):
                return not self._has_own_sleep
            case ast.Attribute(attr="sleep"):
                return True
            case ast.Attribute(attr=name, ctx=ast.Load()):
                module, *others = dotted(node) or [""]
                is_of_proxy = module == "self" and others[0] in self._proxies and len(others) > 1
                is_other = self._is_open and len(others) < 2 and name not in self._given
                if not (module in modules or is_of_proxy) and (is_other or name in self._handwritten):
                    return True  # hand-written, whatever name the component has here
                if module == "self" and len(others) < 2:  # what it was given was found where it got it
                    return False
                return name in _NAMED
            case ast.Name(id=name):
                full = modules.get(name, name)
                last = full.split(".")[-1]
                return last == _SLEEP or last in _WAITING_BUILTINS or (full != name and last in _NAMED)
            case ast.Call():
                return self._may_wait(node, modules)
        return False

    def _is_endless(self, node: ast.AST, modules: Mapping[str, str]) -> bool:
        """Return whether only the body of a loop over something may end it, as with `while`."""
        match node:
            case ast.Name(id=name, ctx=ast.Load()) | ast.Attribute(attr=name, ctx=ast.Load()):
                return name in self._endless
            case ast.NamedExpr(value=value):
                return self._is_endless(value, modules)
            case ast.Call(func=function, args=arguments):
                name = full_name(function, modules)
                if name in _ENDLESS or _calls_until(node, modules):
                    return True
                endless = [self._is_endless(each, modules) for each in arguments]
                return name in _PASSING_ON and any(endless) and (name != "zip" or all(endless))
        return False

    def _may_wait(self, call: ast.Call, modules: Mapping[str, str]) -> bool:
        if isinstance(call.func, ast.Attribute) and self._waits(call.func, call):
            return True
        if may_be_named(call, _FOUND_BY_NAME | self._handwritten, modules) or _calls_until(call, modules):
            return True
        first, *others = dotted(call.func) or [""]
        if first == "self":
            return False
        if first not in modules and (others or "*" not in modules):
            return False
        return _may_wait_in(".".join([modules.get(first, modules.get("*", "")), *others]))

    def _waits(self, function: ast.Attribute, call: ast.Call) -> bool:
        """Return whether a method, whose object is not known, may wait."""
        arguments = len(call.args) + len(call.keywords)
        match function.attr:
            case "get":  # of a queue, not of a dictionary
                return not call.args or any(each.arg in ("block", "timeout", None) for each in call.keywords)
            case "exception":  # of a future, not of a log
                return arguments == 0 or _is_number(call)
            case "run":  # of a timer
                return self._has_threads
            case "join":  # of a thread, not of a text
                is_text = isinstance(function.value, ast.Constant)
                may_be_time = _is_number(call) or (self._has_threads and not _are_texts(call))
                return not is_text and (arguments == 0 or may_be_time)
            case name:
                return name in _WAITING_METHODS

    def _may_be_lock(self, node: ast.expr, modules: Mapping[str, str]) -> bool:
        """Return whether what a `with` enters may be a lock: any function may return one that it is given."""
        if not isinstance(node, ast.Call):
            return True
        full, given = full_name(node.func, modules), (*node.args, *(each.value for each in node.keywords))
        is_of_library = (dotted(node.func) or [""])[0] in modules and not full.startswith("threading.")
        is_made = is_of_library and all(isinstance(each, ast.Constant) for each in given)
        return self._has_threads and not (is_made or full == "open")


def _may_wait_in(name: str) -> bool:
    """Return whether something of a library, by its full name, may wait: also of another one inside it."""
    first, *others = name.split(".")
    is_quick = first in _QUICK_MODULES or name.startswith(_QUICK_PACKAGES)
    is_starred = "*" in others and first not in _QUICK_STARS
    return (
        not is_quick
        or is_starred
        or any(each in _MODULES_INSIDE or (each.startswith("_") and each not in HARMLESS) for each in others)
    )


def called_in(nodes: Iterable[ast.AST]) -> set[ast.AST]:
    """Return the expressions that are called where they stand."""
    return {node.func for node in nodes if isinstance(node, ast.Call)}


def hides(node: ast.AST, called: Collection[ast.AST], modules: Mapping[str, str]) -> bool:
    """Return whether a node names a special attribute, or what finds attributes: it may lead to anything."""
    match node:
        case ast.Attribute(attr=name) | ast.Name(id=name):
            return _is_hidden(name) or (node not in called and bool(finder_of(node, modules)))
        case ast.MatchClass(kwd_attrs=names):
            return any(map(_is_hidden, names))
    return False


def _is_hidden(name: str) -> bool:
    """Return whether Python gives a meaning to a name by which code reaches what it does not name."""
    return name == "modules" or (name.startswith("__") and name not in HARMLESS)


def _given_names(nodes: Iterable[ast.AST]) -> Iterator[tuple[list[ast.expr], ast.expr]]:
    """Yield the expressions that get names, each with these."""
    for node in nodes:
        match node:
            case ast.Assign(value=value, targets=targets) if all(map(dotted, targets)):
                yield targets, value
            case (
                ast.AnnAssign(value=ast.expr() as value, target=target)
                | ast.NamedExpr(value=value, target=target)
            ) if dotted(target):
                yield [target], value


def _taken_from(node: ast.AST, modules: Mapping[str, str]) -> list[ast.expr]:
    """Return the iterators from which a call takes no more than what is asked for."""
    match node:
        case ast.Call(func=function, args=arguments):
            name = full_name(function, modules)
            if name in _PASSING_ON:
                return arguments
            if name in _TAKING_SOME and not any(
                isinstance(each, ast.Constant) and each.value is None for each in arguments[:3]
            ):
                return arguments[:1]
    return []


def _classes(node: ast.AST) -> Iterator[ast.AST]:
    """Yield what is only compared with the class of something."""
    match node:
        case ast.ExceptHandler(type=ast.expr() as kinds):
            yield from ast.walk(kinds)
        case ast.Call(func=ast.Name("isinstance" | "issubclass"), args=[_, kinds]):
            yield from ast.walk(kinds)


def may_be_named(call: ast.Call, names: Collection[str], modules: Mapping[str, str]) -> bool:
    """Return whether a call may find one of these methods by its name."""
    function = full_name(call.func, modules).rpartition(".")[2]
    if function not in FINDERS:
        return False
    first = 1 if function == "getattr" else 0
    given = call.args[first:] if function == "attrgetter" else call.args[first : first + 1]
    return not given or any(_may_be(each, names) for each in given)


def _may_be(name: ast.expr, names: Collection[str]) -> bool:
    """Return whether the name of an attribute, or a path to it, may be one of these."""
    match name:
        case ast.Constant(value=value):
            return any(each in names or _is_hidden(each) for each in str(value).split("."))
        case ast.JoinedStr(values=parts):
            texts = [str(part.value) for part in parts if isinstance(part, ast.Constant)]
            ends = [part.value if isinstance(part, ast.Constant) else "_" for part in (parts[0], parts[-1])]
            is_special = str(ends[0]).startswith("_") and str(ends[1]).endswith("_")
            return is_special or any(all(text in each for text in texts) for each in names)
    return True


def _calls_until(call: ast.Call, modules: Mapping[str, str]) -> bool:
    """Return whether a call makes an iterator that calls something until a value comes."""
    return full_name(call.func, modules) == "iter" and len(call.args) == 2


def _is_number(call: ast.Call) -> bool:
    match call:
        case ast.Call(args=[ast.Constant(value=int() | float())]):
            return True
    return any(each.arg in ("timeout", None) for each in call.keywords)


def _are_texts(call: ast.Call) -> bool:
    """Return whether a call has an argument that certainly is no time: what a text joins."""
    shown = ast.List | ast.Tuple | ast.Set | ast.ListComp | ast.SetComp | ast.GeneratorExp
    names = [dotted(each.func)[-1:] for each in call.args if isinstance(each, ast.Call)]
    return any(isinstance(each, shown) for each in call.args) or any(
        name[0] in _GIVING_TEXTS for name in names if name
    )
