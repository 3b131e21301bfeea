"""Find what the code of a document defines and assigns, and how far names mean what they seem to mean."""

from __future__ import annotations

import ast
import builtins
import re
from collections.abc import Mapping
from enum import IntFlag
from functools import lru_cache
from typing import Final

from ._possible_values import HARMLESS, NOTHING, PLAIN, SELF, SENDER, UNSURE, WHOLE, Value, Values, combined
from .analysis import Analysis, Piece
from .code.names import COMPONENT_ALIASES, COMPONENT_ATTRIBUTES, camel_case, component_name, reserved_names
from .code.text import all_nodes, binds, bound_names, dotted, own_nodes
from .document import TF

_REFLECTION: Final = frozenset(
    {
        *("eval", "exec", "vars", "locals", "globals", "import_module", "getmembers", "builtins", "ctypes"),
        *("currentframe", "_getframe", "_current_frames", "exc_info", "walk_stack", "walk_tb", "modules"),
        *("f_back", "f_builtins", "f_globals", "f_locals", "ag_frame", "cr_frame", "gi_frame", "tb_frame"),
        *("get_objects", "get_referents", "get_referrers", "mock", "setattr", "delattr"),
        *("addaudithook", "current_thread", "excepthook", "main_thread", "monitoring", "unraisablehook"),
        *("setprofile", "setprofile_all_threads", "settrace", "settrace_all_threads"),
        *("Formatter", "ForwardRef", "dictConfig", "fileConfig", "get_type_hints", "singledispatch"),
        "singledispatchmethod",
    }
)
_MODULES: Final = frozenset({"gc", "hfsm_runtime", "importlib", "inspect", "pdb", "pkgutil", "runpy"})
"""Names and modules by which code can reach what it does not name, as it can by special attributes."""
FINDERS: Final = frozenset({"attrgetter", "getattr", "methodcaller"})
"""Functions that find an attribute by its name."""
_OF_TUPLES: Final = frozenset({"_asdict", "_fields", "_make", "_replace"})
"""Attributes of named tuples, which are no more private than others."""
_PURE: Final = frozenset({"abs", "bool", "float", "int", "isinstance", "len", "max", "min", "round", "str"})
_TEXT_METHODS: Final = frozenset({"endswith", "isalpha", "isdigit", "lower", "startswith", "strip", "upper"})
_OF_ARGUMENTS: Final = ("abs", "max", "min", "random.gauss", "random.uniform", "round", "str")
_OF_WHOLE: Final = ("abs", "max", "min", "round")
"""Those that give a whole number of whole ones."""
_WHOLE: Final = ("bool", "int", "isinstance", "len", "random.randint", "random.randrange")
_OF_MATH: Final = ("math.ceil", "math.floor", "math.prod", "math.sumprod", "math.trunc")
"""Functions whose result is of the kind of their arguments: they call methods of an object, or operators."""
_NUMBERS: Final = ("random.randint", "random.random", "random.randrange")
"""Other functions with a plain result, whatever their arguments are."""
_RANDOM_LIBRARIES: Final = ("random.", "secrets.", "uuid.", "numpy.random.", "os.urandom")
_RANDOM: Final = frozenset({"choice", "gauss", "rand", "randint", "randn", "random", "randrange", "uniform"})
_TAKING: Final = frozenset({"next", "pop", "popleft", "read", "readline", "recv", "get_nowait", "shuffle"})
_TYPES: Final = frozenset({"bool", "float", "int", "str"})
_LITERAL: Final = (
    *(ast.Constant, ast.Dict, ast.List, ast.Set, ast.Tuple, ast.BinOp, ast.UnaryOp),
    *(ast.operator, ast.unaryop, ast.expr_context),
)
_PATH: Final = re.compile(r"[\w.:/]+")


class Answer(IntFlag):
    """The possible answers of a guard that is evaluated for the second time in one cycle.

    OTHER ones use random numbers, read a sensor, or take something from a container. Evaluating a guard that
    CHANGES something may change the answers of others.
    """

    SAME = 0
    UNKNOWN = 1
    OTHER = 2
    CHANGES = 4


UNKNOWN: Final = Answer.UNKNOWN | Answer.CHANGES
"""The answer of code that cannot be followed."""


def finder_of(node: ast.AST, modules: Mapping[str, str]) -> str:
    """Return the name of a function that finds attributes by their names, nothing for anything else."""
    match node:
        case ast.Name(id=name):
            found = modules.get(name, name).rpartition(".")[2]
        case ast.Attribute(attr=found):
            pass
        case _:
            return ""
    return found if found in FINDERS else ""


class Definitions:
    """Everything that the code of a document defines and assigns.

    The code is `opaque` if names may not mean what they seem to, because of classes, `import *` or code that
    cannot be followed: then only constants keep their value. It is `exposed` if Python, hand-written code or
    code that cannot be read has the component from the start.
    """

    def __init__(self, analysis: Analysis) -> None:
        document = analysis.document
        self.libraries = analysis.libraries
        self.proxies = {each.name for each in document.all_interfaces} | set(document.proxy_aliases)
        self.arriving = {each.name for each in document.ros} | set(document.ros_aliases)
        """The attributes with the newest message, which may change at any time."""
        self._given = COMPONENT_ATTRIBUTES | {"ros", *document.ros_aliases, *analysis.old_names.reserved}
        self._shared: set[str] = set()
        self.globals: set[str] = set()
        """Variables that code assigns from within functions, and those of the whole file."""
        self.functions: dict[str, ast.FunctionDef] = {}
        self.unclear_attributes: set[str] = set()
        """Names among the functions whose reading may run code that cannot be followed."""
        self._bound = {name for automaton in document.automata for name in automaton.declared}
        self._among_functions = analysis.defined
        self.defined = set(analysis.defined)
        self._assigned: set[str] = set()
        """Attributes that the document defines, and those that code assigns, of whatever object."""
        self._users: dict[str, set[int]] = {}  # the automata whose code uses an attribute, 0 for functions
        stem = analysis.path.stem
        builtin_names = {*dir(builtins)} - {"super"}
        self.classes = {camel_case(component_name(stem)), "super", *reserved_names(document)} - builtin_names
        self.classes |= {"compile"} - self.libraries.keys()
        """Names of the file that lead to the class of the component, or to any code."""
        self._file = {*self.libraries, *document.ros_messages, TF, *builtin_names, *HARMLESS}
        self._modules = _MODULES | {stem}
        self._imported = {name for name, path in self.libraries.items() if self.is_reflective_import(path)}
        self.is_exposed = analysis.extension is not None or not analysis.is_complete
        self.is_opaque = self.is_exposed or "*" in self.libraries
        for piece in analysis.functions:
            for node in piece.tree.body:
                self._define(node)
        for piece in analysis.pieces:
            self._read(piece)

    def _define(self, node: ast.stmt) -> None:
        """Record what a statement among the functions defines in the component."""
        names = bound_names(ast.Module([node], []))
        self._expose(any(name.startswith("__") for name in names))  # Python calls it
        match node:
            case _ if names & (self.functions.keys() | self.unclear_attributes):
                self.unclear_attributes |= names  # one of several with this name
            case ast.FunctionDef(name=name) if not node.decorator_list or (
                is_static(node) and "staticmethod" not in {*self._among_functions, *self.libraries}
            ):
                self.functions[name] = node
            case ast.ClassDef(bases=bases, decorator_list=[], keywords=[]) if all(
                dotted(base) and dotted(base)[0] not in self._among_functions for base in bases
            ):
                pass
            case ast.Assign(value=value) | ast.AnnAssign(value=ast.expr() as value) if all(
                isinstance(each, _LITERAL) for each in ast.walk(value)
            ):
                pass
            case _:
                self.unclear_attributes |= names

    def _read(self, piece: Piece) -> None:
        """Record what code defines, assigns and uses."""
        own = frozenset[ast.AST]() if piece.is_functions else frozenset(own_nodes(piece.tree))
        for node in all_nodes(piece.tree):
            match node:
                case ast.Global(names=names) | ast.Nonlocal(names=names):
                    self._shared.update(names)
                    self.globals.update(names if isinstance(node, ast.Global) else ())
                case ast.Attribute(attr=name, ctx=context):
                    # nested functions, too, may run at any time
                    self._users.setdefault(name, set()).add(piece.automaton if node in own else 0)
                    if not isinstance(context, ast.Load):
                        self._assigned.add(name)
                        self.defined.add(name)
                case ast.GeneratorExp():  # which others may run
                    inside = (each.target for each in ast.walk(node) if isinstance(each, ast.NamedExpr))
                    self._shared.update(target.id for target in inside)
                case ast.keyword(arg=str(name)):
                    self._expose(_is_mangled(name))
                case ast.Constant(value=str(text)) if _PATH.fullmatch(text):  # for a library that gets a name
                    parts = re.split("[.:/]", text)
                    is_path = len(parts) > 1 and parts[0] in self._modules
                    self._expose(is_path or any(map(is_special, parts)))
                case ast.ClassDef():
                    self.is_opaque = True
            names = [node.arg] if isinstance(node, ast.arg) else [*binds(node)]
            self._bound.update(() if isinstance(node, ast.Nonlocal) else names)
            self._expose(any(_is_mangled(name) or name == "__match_args__" for name in names))

    def _expose(self, is_exposed: bool) -> None:
        self.is_opaque |= is_exposed
        self.is_exposed |= is_exposed

    def is_reflective(self, name: str) -> bool:
        """Return whether a name may lead to anything."""
        return is_special(name) or name in self._imported

    def is_reflective_import(self, path: str) -> bool:
        """Return whether an import may lead to anything, such as to the class of the component."""
        return any(is_special(part) or part in self._modules for part in path.split("."))

    def is_private(self, name: str) -> bool:
        """Return whether an attribute of an unknown object is one of those by which libraries work."""
        return name.startswith("_") and name not in self.defined | _OF_TUPLES | HARMLESS

    def finder(self, node: ast.AST) -> str:
        """Return the name of a function that finds attributes by their names, nothing for anything else."""
        return finder_of(node, self.libraries)

    def outside(self, name: str) -> Values:
        """Return the values of a name that is not bound where it is read; none if that is an error."""
        if self._full_name([name]) in _TYPES:
            return PLAIN
        is_known = name in self._file | self.classes or name.endswith("Prx") or self.is_opaque
        return UNSURE if is_known or name in self.globals else NOTHING

    def declared(self, name: str) -> Values:
        """Return the values that an attribute of the component has before code assigns any."""
        found = {Value("proxy", name)} if name in self.proxies else set()
        found |= {Value("function", name)} if name in self.functions else set()
        found |= {SENDER} if name == "send" else set()
        if name in self._among_functions:
            return frozenset(found)
        found |= {SELF} if name in COMPONENT_ALIASES else set()
        is_hidden = name.startswith("_") and name not in self.defined
        return frozenset(found) or (UNSURE if name in self._given or is_hidden else NOTHING)

    def is_library(self, path: list[str]) -> bool:
        """Return whether a dotted name is one that the document neither binds nor assigns."""
        return bool(path) and path[0] not in self._bound and self._assigned.isdisjoint(path[1:])

    def is_builtin(self, name: str) -> bool:
        """Return whether a name is still that of Python: neither the document nor a library binds it."""
        return self.is_library([name]) and self.libraries.keys().isdisjoint((name, "*"))

    def answer_of_library(self, node: ast.Attribute) -> Answer:
        """Return the answer that an attribute of no followed value allows if its values are plain.

        What a library writes in capitals is a constant, and so are the modules of random numbers.
        """
        path = dotted(node)
        full = self._full_name(path) if path and path[0] in self.libraries else ""
        is_constant = bool(full) and (node.attr.isupper() or f"{full}.".startswith(_RANDOM_LIBRARIES))
        return Answer.SAME if is_constant else Answer.UNKNOWN

    def is_constant(self, node: ast.Attribute) -> bool:
        """Return whether an attribute is a number of a library, or belongs to a generated interface."""
        path = dotted(node)
        full = self._full_name(path) if path and path[0] in self.libraries else ""
        is_member = full.startswith("interfaces.") and full.split(".")[-2][:1].isupper()  # of an enumeration
        return full.startswith("math.") or is_member

    def _full_name(self, path: list[str]) -> str:
        """Return the full name of something of a library or of Python that the document does not replace."""
        if self.is_opaque or not self.is_library(path):
            return ""
        return ".".join([self.libraries.get(path[0], path[0]), *path[1:]])

    def answer_of_name(self, name: str) -> Answer:
        """Return the answer that a variable or parameter allows if its values are plain."""
        return UNKNOWN if self.is_opaque or name in self._shared else Answer.SAME

    def answer_of_attribute(self, name: str, automaton: int) -> Answer:
        """Return the answer that an attribute of the component allows; `automaton` is 0 in functions."""
        if name in self.arriving:
            return Answer.OTHER
        is_own = automaton != 0 and self._users.get(name) == {automaton}
        stays = not self.is_opaque and (is_own or name not in self._assigned)
        return Answer.SAME if stays else Answer.UNKNOWN

    def answer_of_call(self, call: ast.Call, *, is_of_text: bool) -> Answer:
        """Return the answer that a call of a library, or of a method of a text, allows."""
        path = dotted(call.func)
        name = path[-1] if path else getattr(call.func, "attr", "")
        if path == ["self", "clock", "now"]:
            return Answer.UNKNOWN
        full = self._full_name(path)
        if name in self._bound or self.is_pure(call, is_of_text=is_of_text):
            return UNKNOWN if name in self._bound else Answer.SAME
        if full.startswith(_RANDOM_LIBRARIES) or name in _RANDOM:
            return Answer.OTHER
        return Answer.OTHER | Answer.CHANGES if name in _TAKING else UNKNOWN

    def is_pure(self, call: ast.Call, *, is_of_text: bool) -> bool:
        """Return whether a call of a library only computes with its arguments."""
        full = self._full_name(dotted(call.func))
        if full in ("max", "min"):  # a single argument may be a generator
            return len(call.args) > 1 and not any(isinstance(each, ast.Starred) for each in call.args)
        is_method = is_of_text and isinstance(call.func, ast.Attribute) and call.func.attr in _TEXT_METHODS
        return full in _PURE or full.startswith("math.") or (is_method and not self.is_opaque)

    def is_random_choice(self, call: ast.Call) -> bool:
        """Return whether a call is one of `random.choice`."""
        return self._full_name(dotted(call.func)) == "random.choice"

    def result_of(self, call: ast.Call, *, is_of_text: bool, arguments: list[Values]) -> Values:
        """Return what a call of a library gives."""
        path = dotted(call.func)
        full = self._full_name(path)
        if full in _OF_ARGUMENTS + _OF_MATH:
            are_whole = bool(arguments) and combined(*arguments) == WHOLE and len(arguments) == len(call.args)
            return WHOLE if are_whole and full in _OF_WHOLE else combined(PLAIN, *arguments)
        if full in _WHOLE:
            return WHOLE
        is_clock = path == ["self", "clock", "now"] and self.defined.isdisjoint(path)
        is_known = is_clock or full in (*_PURE, *_NUMBERS) or full.startswith("time.")
        return PLAIN if is_known or self.is_pure(call, is_of_text=is_of_text) else UNSURE


def is_special(name: str) -> bool:
    """Return whether Python gives a meaning to a name by which code reaches what it does not name."""
    return name in _REFLECTION or (name.startswith(("__", "_hfsm_")) and name not in HARMLESS)


def is_static(function: ast.FunctionDef) -> bool:
    """Return whether a function is a static method and nothing else."""
    return [ast.unparse(each) for each in function.decorator_list] == ["staticmethod"]


def _is_mangled(name: str) -> bool:
    """Return whether Python gives a name in a class another name."""
    return name.startswith("__") and not name.endswith("__")


@lru_cache(maxsize=4096)
def yields(function: ast.AST) -> bool:
    """Return whether a function is a generator: a call of it runs nothing yet."""
    return any(isinstance(node, ast.Yield | ast.YieldFrom) for node in own_nodes(function))
