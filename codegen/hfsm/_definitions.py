"""Find what the code of a document defines and assigns, and which guards keep their value within a cycle."""

from __future__ import annotations

import ast
from enum import IntFlag
from typing import Final

from .analysis import Analysis, Piece
from .code.names import COMPONENT_ALIASES, COMPONENT_ATTRIBUTES
from .code.text import all_nodes, binds, bound_names, dotted

_REFLECTION: Final = frozenset(
    {
        *("eval", "exec", "vars", "locals", "globals", "__import__", "import_module", "getmembers"),
        *("currentframe", "_getframe", "f_locals", "builtins", "__builtins__", "ctypes"),
        *("get_objects", "get_referents", "get_referrers"),
        *("__dict__", "__self__", "__globals__", "__closure__", "__getattribute__", "__getattr__"),
    }
)
"""Names by which code can find objects or attributes that it does not name."""
_ANY_NAME: Final = _REFLECTION | {"setattr", "__setattr__"}
"""Names by which code can assign names that it does not contain."""
_PURE: Final = frozenset({"abs", "bool", "float", "int", "isinstance", "len", "round", "str"})
_PURE_OF_SEVERAL: Final = frozenset({"max", "min"})
"""A single argument may be a generator."""
_PURE_METHODS: Final = frozenset({"endswith", "isalpha", "isdigit", "lower", "startswith", "strip", "upper"})
"""Methods of texts."""
_OF_THEIR_ARGUMENTS: Final = frozenset(
    {
        *("abs", "max", "min", "round"),
        *("math.ceil", "math.floor", "math.prod", "math.sumprod", "math.trunc"),
    }
)
"""Functions whose result is of the kind of their arguments: they call methods of an object."""
_NUMBERS: Final = frozenset(
    {
        *("bool", "float", "int", "isinstance", "len", "str"),
        *("random.gauss", "random.randint", "random.random", "random.randrange", "random.uniform"),
        *("time.monotonic", "time.perf_counter", "time.time"),
    }
)
"""Functions with a plain result, whatever their arguments are; so have those of `math`."""
_CONSTANTS: Final = frozenset({"math.e", "math.inf", "math.nan", "math.pi", "math.tau"})
_RANDOM_LIBRARIES: Final = ("random.", "secrets.", "uuid.", "numpy.random.", "os.urandom")
_RANDOM: Final = frozenset({"choice", "gauss", "rand", "randint", "randn", "random", "randrange", "uniform"})
_TAKING: Final = frozenset({"next", "pop", "popleft", "read", "readline", "recv", "get_nowait", "shuffle"})
_OPERATORS: Final = (ast.Compare, ast.BinOp, ast.UnaryOp, ast.BoolOp, ast.Subscript)
_DISPLAYS: Final = (ast.Tuple, ast.List, ast.Set, ast.Dict, ast.Constant)
_PLAIN: Final = (
    *(ast.expr_context, ast.boolop, ast.operator, ast.unaryop, ast.cmpop, ast.keyword, ast.Starred),
    *(ast.Module, ast.IfExp, *_OPERATORS, *_DISPLAYS, ast.JoinedStr, ast.FormattedValue, ast.Slice),
    *(ast.Return, ast.Expr, ast.If, ast.Pass, ast.Assign, ast.AnnAssign, ast.Raise, ast.Assert),
)
"""Nodes that change nothing by themselves."""
_LITERAL: Final = (*_DISPLAYS, ast.UnaryOp, ast.BinOp, ast.operator, ast.unaryop, ast.expr_context)


class Answer(IntFlag):
    """How a guard may answer when it is evaluated for the second time in one cycle.

    OTHER ones use random numbers, read a sensor, or take something from a container. Evaluating a guard that
    CHANGES something may change the answers of others.
    """

    SAME = 0
    UNKNOWN = 1
    OTHER = 2
    CHANGES = 4


UNKNOWN: Final = Answer.UNKNOWN | Answer.CHANGES
"""The answer of code that cannot be followed."""


class Definitions:
    """Everything that the code of a document defines and assigns.

    The code is `opaque` if classes or special methods of the document may define operators, or if `eval` and
    the like, `import *` or hand-written code beside the document may assign anything: then only constants
    keep their value.
    """

    def __init__(self, analysis: Analysis) -> None:
        document = analysis.document
        self.libraries = analysis.libraries
        self.proxies = {each.name for each in document.all_interfaces} | set(document.proxy_aliases)
        self.arriving = {each.name for each in document.ros} | set(document.ros_aliases)
        """The attributes with the newest message, which may change at any time."""
        self._declared = self.proxies | {each.name for each in document.parameters}
        self._declared |= COMPONENT_ATTRIBUTES | COMPONENT_ALIASES
        self._is_extended = analysis.extension is not None
        self.is_opaque = self._is_extended or not analysis.is_complete or "*" in self.libraries
        self.has_special_methods = False
        """Whether Python itself may call functions of the component, such as `__getattr__`."""
        self.functions: dict[str, ast.FunctionDef] = {}
        self.unclear_attributes: set[str] = set()
        """Names among the functions that are not plain functions, classes or constants."""
        self.bound = {name for automaton in document.automata for name in automaton.declared}
        """Every name that the document binds."""
        self.shared: set[str] = set()
        """Variables that code assigns from within functions, or for the whole file."""
        self.globals: set[str] = set()
        """Global names, which are not followed."""
        self._assigned = set(analysis.defined)
        """Attributes of the component that are assigned."""
        self._replaced: set[str] = set()
        """Attributes that are assigned of other objects, such as modules."""
        self._users: dict[str, set[int]] = {}
        """The automata whose code uses an attribute, 0 for functions."""
        self._answers: dict[tuple[ast.AST, int], Answer] = {}
        self.reflection = _REFLECTION | {
            name for name, full in self.libraries.items() if not _REFLECTION.isdisjoint(full.split("."))
        }
        for piece in analysis.functions:
            for node in piece.tree.body:
                self._define(node)
        self.is_opaque |= self.has_special_methods
        for piece in analysis.pieces:
            self._read(piece)

    def _define(self, node: ast.stmt) -> None:
        """Record what a statement among the functions defines in the component."""
        names = bound_names(ast.Module([node], []))
        self.has_special_methods |= any(name.startswith("__") for name in names)
        self.unclear_attributes -= names
        for name in names:
            self.functions.pop(name, None)
        match node:
            case ast.FunctionDef(name=name) if not node.decorator_list or is_static(node):
                self.functions[name] = node
            case ast.ClassDef(decorator_list=[], keywords=[]):
                pass
            case ast.Assign(value=value) | ast.AnnAssign(value=ast.expr() as value) if all(
                isinstance(each, _LITERAL) for each in ast.walk(value)
            ):
                pass
            case _:
                self.unclear_attributes |= names

    def _read(self, piece: Piece) -> None:
        """Record what code defines, assigns and uses."""
        for node in all_nodes(piece.tree):
            match node:
                case ast.Global(names=names) | ast.Nonlocal(names=names):
                    self.shared.update(names)
                    self.globals.update(names if isinstance(node, ast.Global) else ())
                case ast.Attribute(attr=name, ctx=context, value=owner):
                    self._users.setdefault(name, set()).add(0 if piece.is_functions else piece.automaton)
                    if not isinstance(context, ast.Load):
                        self._assigned.add(name)
                        if not (isinstance(owner, ast.Name) and owner.id == "self"):
                            self._replaced.add(name)
                    self.is_opaque |= name in _ANY_NAME
                case ast.Name(id=name, ctx=ast.Load()):
                    self.is_opaque |= name in _ANY_NAME
                case ast.arg(arg=name):
                    self.bound.add(name)
                case ast.ClassDef():
                    self.is_opaque = True
            if not isinstance(node, ast.Nonlocal):
                self.bound.update(binds(node))

    def lose_track(self) -> None:
        """Consider the code opaque from now on, because some of it cannot be followed to its end."""
        self.is_opaque = True
        self._answers.clear()

    def is_assigned(self, name: str) -> bool:
        """Return whether code assigns an attribute of the component."""
        return name in self._assigned

    def is_unclear_attribute(self, name: str) -> bool:
        """Return whether reading an attribute of the component may run code that cannot be followed."""
        if name in self.unclear_attributes:
            return True
        is_hidden = self._is_extended or self.has_special_methods
        return is_hidden and name not in self._assigned | self._declared

    def is_library(self, path: list[str]) -> bool:
        """Return whether a dotted name begins with a name that the document does not bind."""
        return bool(path) and path[0] not in self.bound

    def is_unknown(self, function: ast.expr) -> bool:
        """Return whether a called expression is an object of the document, of which nothing is known."""
        match dotted(function):
            case []:
                return not (isinstance(function, ast.Attribute) and isinstance(function.value, _DISPLAYS))
            case ["self", name, *_]:
                return name not in COMPONENT_ATTRIBUTES | self.proxies or name in self._assigned
            case path:
                return not self.is_library(path)

    def is_constant(self, node: ast.Attribute) -> bool:
        """Return whether an attribute is a number of a library, or belongs to a generated interface."""
        path = dotted(node)
        full = self._full_name(path) if path and path[0] in self.libraries else ""
        return full in _CONSTANTS or full.startswith("interfaces.")

    def _full_name(self, path: list[str]) -> str:
        """Return the full name of something of a library or of Python, empty for anything else.

        It is empty, too, for what the document replaces in a module.
        """
        if not self.is_library(path) or not self._replaced.isdisjoint(path):
            return ""
        return ".".join([self.libraries.get(path[0], path[0]), *path[1:]])

    def answer_of_node(self, node: ast.AST, automaton: int) -> Answer:
        """Return the answer that a node allows; `automaton` is 0 in functions, whose variables are local."""
        place = node, automaton
        if place not in self._answers:  # code is evaluated several times
            self._answers[place] = self._answer_of_node(node, automaton)
        return self._answers[place]

    def _answer_of_node(self, node: ast.AST, automaton: int) -> Answer:
        match node:
            case ast.Attribute(ctx=ast.Load()):
                return self._answer_of_attribute(node, automaton)
            case ast.Name(id=name, ctx=context):
                is_own = isinstance(context, ast.Load) or automaton == 0
                stays = is_own and name not in self.shared and not self.is_opaque
                return Answer.SAME if stays else UNKNOWN
            case ast.Attribute() | ast.Subscript(ctx=ast.Store() | ast.Del()):
                return UNKNOWN
            case ast.NamedExpr() | ast.Await():
                return Answer.OTHER | Answer.CHANGES
            case ast.Call():
                return Answer.SAME  # see answer_of_call
            case ast.Compare(ops=operators, comparators=compared):
                for operator, right in zip(operators, compared, strict=True):
                    if isinstance(operator, ast.In | ast.NotIn) and not isinstance(right, _DISPLAYS):
                        return UNKNOWN  # it may be a generator
        is_plain = isinstance(node, _PLAIN) and not (self.is_opaque and isinstance(node, _OPERATORS))
        return Answer.SAME if is_plain else UNKNOWN

    def _answer_of_attribute(self, node: ast.Attribute, automaton: int) -> Answer:
        path = dotted(node)
        is_known = path[:1] == ["event"] or (bool(path) and path[0] in self.libraries)
        if is_known and path[0] not in self.bound and self._replaced.isdisjoint(path):
            return Answer.SAME
        if path[:1] != ["self"] or (len(path) > 2 and path[1] not in self.proxies):
            return UNKNOWN if node.attr in self.bound else Answer.UNKNOWN
        name = path[1]
        if name in self.arriving:
            return Answer.OTHER
        if name in self.functions:
            return UNKNOWN
        is_own = automaton != 0 and self._users.get(name) == {automaton}
        stays = not self.is_opaque and (is_own or name not in self._assigned)
        return Answer.SAME if stays else Answer.UNKNOWN

    def answer_of_call(self, call: ast.Call, *, is_of_text: bool) -> Answer:
        """Return the answer that a call with plain arguments allows if it is not followed.

        `is_of_text` says whether it is a method of a text.
        """
        path = dotted(call.func)
        name = path[-1] if path else getattr(call.func, "attr", "")
        if path[:1] == ["self"] and len(path) > 2 and path[1] in self.proxies:
            return Answer.OTHER
        if path == ["self", "clock", "now"]:
            return Answer.UNKNOWN
        if name in self.bound:
            return UNKNOWN
        full = self._full_name(path)
        if full.startswith(_RANDOM_LIBRARIES) or name in _RANDOM:
            return Answer.OTHER
        if name in _TAKING:
            return Answer.OTHER | Answer.CHANGES
        several = len(call.args) > 1 and not any(isinstance(each, ast.Starred) for each in call.args)
        is_pure = full in _PURE or (full in _PURE_OF_SEVERAL and several) or full.startswith("math.")
        is_method = is_of_text and name in _PURE_METHODS
        return Answer.SAME if (is_pure or is_method) and not self.is_opaque else UNKNOWN

    def has_plain_result(self, call: ast.Call, *, is_of_text: bool, of_plain: bool) -> bool:
        """Return whether a call that is not followed has a plain result.

        `is_of_text` says whether it is a method of a text, `of_plain` whether its arguments are plain.
        """
        path = dotted(call.func)
        if path == ["self", "clock", "now"]:
            return not self.is_assigned("clock")
        if isinstance(call.func, ast.Attribute) and call.func.attr in _PURE_METHODS:
            return is_of_text
        full = self._full_name(path)
        if full in _OF_THEIR_ARGUMENTS:
            return of_plain
        return full in _NUMBERS or full.startswith("math.")


def is_static(function: ast.FunctionDef) -> bool:
    """Return whether a function is a static method and nothing else."""
    return [each.id for each in function.decorator_list if isinstance(each, ast.Name)] == ["staticmethod"]
