"""Analyze the code of a document: parse every piece once, and know where it stands and what it uses.

The checks and the model checker read this analysis; none of them parses code. Trees are shared, also between
analyses of the same text, and must not be changed.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Final

from ..diagnostics import Location
from .code.names import OLD_MODULES
from .code.pieces import is_foreign
from .code.python import analyze_library
from .code.text import Code, CodeError, all_nodes, own_nodes, parse, parse_python, split
from .document import Automaton, Document, Library, State, Text, Transition
from .extension import Extension, read_extension

__all__ = ["Access", "Analysis", "AutomatonCode", "Piece", "analyze", "imported_names", "library_names"]

COMPONENT_ALIASES: Final = frozenset({"globalNamespace", "interfaces", "namespace", "rosNode"})
"""What VisualStates calls the component in places; each is the component itself."""

_DEEPEST: Final = 150
"""Nodes below one another in code that is looked into: the checks go down with Python's stack."""


@dataclass(frozen=True, eq=False)
class Piece:
    """A piece of code: `tree` counts lines as `code` does, after `header` lines of ours.

    With `is_functions` it becomes methods of the component, else a function that shares the names of its
    automaton; with `has_event` that one takes the event. One that is nested too deeply `is_deep`.
    """

    tree: ast.Module
    code: Code
    header: int
    path: Path
    is_functions: bool = False
    has_event: bool = False
    is_deep: bool = False

    def place(self, node: ast.AST, length: int = 0) -> Location:
        """Return where a node stands in its file; `length` is that of the text to underline."""
        line_of_node, offset = getattr(node, "lineno", 1), getattr(node, "col_offset", 0)
        line = min(max(line_of_node - self.header, 1), len(self.code.lines))
        before = self.code.lines[line - 1].encode()[:offset].decode(errors="replace")
        left = 0 if line - 1 in self.code.fixed else self.code.removed
        if line == 1:
            left = self.code.start - 1
        if not length and getattr(node, "end_lineno", None) == line_of_node:
            length = getattr(node, "end_col_offset", offset) - offset
        return Location(self.path, self.code.line + line - 1, left + len(before) + 1, max(1, length))

    def place_of_attribute(self, node: ast.Attribute) -> Location:
        """Return where the name of an attribute stands."""
        end = ast.copy_location(ast.Name(node.attr), node)
        end.lineno = node.end_lineno or node.lineno
        end.col_offset = (node.end_col_offset or 0) - len(node.attr.encode())
        return self.place(end, len(node.attr))

    @property
    def expression(self) -> ast.expr | None:
        """The expression that a condition or an argument is, None for statements."""
        match self.tree.body:
            case [ast.Expr(value=value)] | [ast.Return(value=ast.expr() as value)]:
                return value
        return None

    @cached_property
    def reads(self) -> frozenset[str]:
        """The names that it reads, in its own scope or in those within."""
        names: set[str] = set()
        for node in all_nodes(self.tree):
            match node:
                case ast.Name(id=name, ctx=ast.Load() | ast.Del()):
                    names.add(name)
                case ast.AugAssign(target=ast.Name(id=name)):
                    names.add(name)  # a counter, which the monitor shows
                case ast.Global(names=declared):
                    names.update(declared)
        return frozenset(names)

    @cached_property
    def defines(self) -> frozenset[str]:
        """The names that it assigns, defines or imports in its own scope."""
        names: set[str] = set()
        for node in own_nodes(self.tree):
            match node:
                case ast.Name(id=name, ctx=ast.Store()):
                    names.add(name)
                case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name) | ast.ClassDef(name=name):
                    names.add(name)
                case ast.alias(name=name, asname=alias):
                    names.add(alias or name.split(".")[0])
        return frozenset(names)

    @cached_property
    def accesses(self) -> tuple[Access, ...]:
        """The uses of the component."""
        if not self.is_functions:
            return tuple(_accesses(self, None, list(self.tree.body), "self"))
        found: list[Access] = []
        for node in self.tree.body:
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                arguments = [*node.args.posonlyargs, *node.args.args]
                if arguments and not _is_static(node):
                    found += _accesses(self, node.name, list(node.body), arguments[0].arg)
        return tuple(found)


@dataclass(frozen=True, eq=False, slots=True)
class Access:
    """A use of the component: `self.Head.getPose.latest()` has the path Head, getPose, latest and its call.

    `function` is the function of the document in which it stands, if it stands in one. `is_stored` is true
    where the first attribute itself is assigned or deleted.
    """

    piece: Piece
    function: str | None
    path: tuple[str, ...]
    nodes: tuple[ast.Attribute, ...]
    call: ast.Call | None
    is_stored: bool

    @property
    def name(self) -> str:
        """The first attribute."""
        return self.path[0]


@dataclass(eq=False)
class AutomatonCode:
    """All code of an automaton; that of states by their id, that of transitions by the transition itself.

    It is `broken` when some of it is missing, because it is no Python or nested too deeply: then nobody knows
    what the rest may rely on.
    """

    automaton: Automaton
    variables: Piece | None = None
    functions: Piece | None = None
    entry: dict[int, Piece] = field(default_factory=dict)
    code: dict[int, Piece] = field(default_factory=dict)
    exit: dict[int, Piece] = field(default_factory=dict)
    arguments: dict[int, list[Piece]] = field(default_factory=dict)
    conditions: dict[int, Piece] = field(default_factory=dict)
    """Conditions and guards, by `id` of the transition."""
    fired: dict[int, Piece] = field(default_factory=dict)
    broken: bool = False

    def running(self) -> Iterator[Piece]:
        """Yield the pieces that run in cycles."""
        for pieces in (self.entry, self.code, self.exit, self.conditions, self.fired):
            yield from pieces.values()
        for arguments in self.arguments.values():
            yield from arguments

    def sharing(self) -> Iterator[Piece]:
        """Yield the pieces that share the automaton's names."""
        if self.variables is not None:
            yield self.variables
        yield from self.running()

    def condition_of(self, transition: Transition) -> Piece | None:
        """Return the condition or the guard of a transition."""
        return self.conditions.get(id(transition))

    def fired_by(self, transition: Transition) -> Piece | None:
        """Return the code that runs when a transition fires."""
        return self.fired.get(id(transition))


@dataclass(eq=False)
class Analysis:
    """What is known of the code of a `document`, which lies at `path` and whose imports are resolved.

    A document in another language than Python has no code here.
    """

    document: Document
    path: Path
    automata: list[AutomatonCode] = field(default_factory=list)
    functions: list[Piece] = field(default_factory=list)
    """Functions of automata and those that belong to none."""
    is_complete: bool = True
    """Whether all code could be parsed."""
    by_text: dict[int, tuple[Text, Path, Piece | None]] = field(default_factory=dict, repr=False)
    """All texts with code by their `id`, each with its file and its piece, None for what is no Python."""

    def piece(self, text: Text) -> Piece | None:
        """Return a text of the document as a piece of code, None for a blank one or one that is no Python."""
        return self.by_text[id(text)][2] if id(text) in self.by_text else None

    def is_broken(self, text: Text) -> bool:
        """Return whether a text of the document is no Python."""
        return id(text) in self.by_text and self.by_text[id(text)][2] is None

    @property
    def pieces(self) -> list[Piece]:
        """All code: the functions, then what automata run."""
        return [*self.functions, *(piece for code in self.automata for piece in code.sharing())]

    @cached_property
    def accesses(self) -> list[Access]:
        """Every use of the component in all code."""
        return [access for piece in self.pieces for access in piece.accesses]

    @cached_property
    def defined(self) -> frozenset[str]:
        """The attributes that functions, and what stands among them, give to the component."""
        return frozenset[str]().union(*(piece.defines for piece in self.functions))

    @cached_property
    def extension(self) -> Extension:
        """The hand-written file beside the component."""
        return read_extension(self.path)

    @cached_property
    def libraries(self) -> dict[str, str]:
        """The names that the libraries bind, with what each stands for; `*` for those of `import *`."""
        found = {module: module for module in (OLD_MODULES if self.document.is_old else ())}
        for node in self._imports:
            found.update(imported_names(node))
        return found

    @cached_property
    def modules(self) -> frozenset[str]:
        """The modules that libraries and code import, dotted."""
        nodes = [*self._imports, *(node for piece in self.pieces for node in all_nodes(piece.tree))]
        found: set[str] = set()
        for node in nodes:
            if isinstance(node, ast.Import):
                found.update(alias.name for alias in node.names)
            elif isinstance(node, ast.ImportFrom):
                found.add(node.module or "")
        return frozenset(found)

    @cached_property
    def _imports(self) -> list[ast.Import | ast.ImportFrom]:
        found = map(_library_import, self.document.libraries)
        return [node for node in found if node is not None]


def analyze(document: Document, path: Path) -> Analysis:
    """Return what is known of the code of a document; what is wrong with it the generator reports."""
    analysis = Analysis(document, path)
    if is_foreign(document):
        return analysis
    reader = _Reader(analysis)
    for automaton in document.automata:
        analysis.automata.append(reader.automaton(automaton))
    analysis.functions += [code.functions for code in analysis.automata if code.functions is not None]
    reader.current = AutomatonCode(Automaton(id=0))
    for functions in document.functions:
        piece = reader.statements(functions.text, functions.path, is_functions=True)
        analysis.functions += [] if piece is None else [piece]
    analysis.is_complete = not any(code.broken for code in (*analysis.automata, reader.current))
    return analysis


def library_names(library: Library) -> dict[str, str]:
    """Return the names that a library binds, with what each stands for; none for what is not imported."""
    node = _library_import(library)
    return {} if node is None else imported_names(node)


def _library_import(library: Library) -> ast.Import | ast.ImportFrom | None:
    """Return the import of a library, None for one that is none: the generator reports it."""
    if not library.is_module or library.name.is_blank:
        return None
    try:
        (node,) = parse_python(analyze_library(library.name)[0]).body
    except CodeError:
        return None
    assert isinstance(node, ast.Import | ast.ImportFrom), "that is what a library is"
    return node


def imported_names(node: ast.Import | ast.ImportFrom) -> dict[str, str]:
    """Return the names that an import binds, with what each stands for."""
    if isinstance(node, ast.ImportFrom):
        return {alias.asname or alias.name: f"{node.module}.{alias.name}" for alias in node.names}
    return {
        alias.asname or alias.name.split(".")[0]: alias.name if alias.asname else alias.name.split(".")[0]
        for alias in node.names
    }


class _Reader:
    """Parse the pieces of `current`, one automaton after the other."""

    def __init__(self, analysis: Analysis) -> None:
        self._analysis = analysis
        self.current = AutomatonCode(Automaton(id=0))

    def automaton(self, automaton: Automaton) -> AutomatonCode:
        found = self.current = AutomatonCode(automaton)
        found.variables = self.statements(automaton.variables, automaton.path)
        found.functions = self.statements(automaton.functions, automaton.path, is_functions=True)
        for state in automaton.states:
            self._state(state)
        for transition in automaton.transitions:
            self._transition(transition)
        return found

    def _state(self, state: State) -> None:
        found = self.current
        for text, pieces in ((state.entry, found.entry), (state.code, found.code), (state.exit, found.exit)):
            piece = self.statements(text, state.path)
            if piece is not None:
                pieces[state.id] = piece
        for argument in state.arguments:
            piece = self._expression(argument.value, argument.path)
            if piece is not None:
                found.arguments.setdefault(state.id, []).append(piece)

    def _transition(self, transition: Transition) -> None:
        has_event = transition.type == "event"
        text = transition.trigger if transition.type == "condition" else transition.guard
        condition = self._expression(text, transition.path, has_event=has_event)
        if condition is not None:
            self.current.conditions[id(transition)] = condition
        fired = self.statements(transition.code, transition.path, has_event=has_event)
        if fired is not None:
            self.current.fired[id(transition)] = fired

    def statements(
        self, text: Text, path: Path | None, *, is_functions: bool = False, has_event: bool = False
    ) -> Piece | None:
        code = split(text)
        if code is None:
            return None
        try:
            tree = parse(code, code.lines)
        except CodeError:
            return self._add(text, path, None)
        piece = Piece(tree, code, 0, path or self._analysis.path, is_functions, has_event, _is_too_deep(tree))
        return self._add(text, path, piece)

    def _expression(self, text: Text, path: Path | None, *, has_event: bool = False) -> Piece | None:
        """Return an expression, which may span lines, or the statements that return one."""
        code = split(text)
        if code is None:
            return None
        try:
            tree = parse(code, ("(", *code.lines, ")"), header=1)
        except CodeError:
            return self.statements(text, path, has_event=has_event)
        if not _is_expression(tree):
            return self._add(text, path, None)
        piece = Piece(tree, code, 1, path or self._analysis.path, False, has_event, _is_too_deep(tree))
        return self._add(text, path, piece)

    def _add(self, text: Text, path: Path | None, piece: Piece | None) -> Piece | None:
        """Remember a piece, None for one that is no Python; return it if the checks can go down into it."""
        self._analysis.by_text[id(text)] = (text, path or self._analysis.path, piece)
        if piece is None or piece.is_deep:
            self.current.broken = True
            return None
        return piece


def _is_expression(tree: ast.Module) -> bool:
    """Return whether a tree is one expression, which leaves the parentheses around it to us."""
    match tree.body:
        case [ast.Expr(value=value)]:
            return value.lineno > 1
    return False


@lru_cache(maxsize=4096)
def _is_too_deep(tree: ast.AST) -> bool:
    level: list[ast.AST] = [tree]
    for _ in range(_DEEPEST):
        level = [child for node in level for child in ast.iter_child_nodes(node)]
        if not level:
            return False
    return True


def _is_static(function: ast.FunctionDef | ast.AsyncFunctionDef) -> bool:
    return any(
        isinstance(decorator, ast.Name) and decorator.id == "staticmethod"
        for decorator in function.decorator_list
    )


def _accesses(piece: Piece, function: str | None, nodes: list[ast.AST], self_name: str) -> Iterator[Access]:
    pending = nodes[::-1]
    while pending:
        node = pending.pop()
        if isinstance(node, ast.ClassDef):
            continue  # its methods have a `self` of their own
        chain_of = node.func if isinstance(node, ast.Call) else node
        chain = _chain(chain_of, self_name)
        if not chain:
            pending += [*ast.iter_child_nodes(node)][::-1]
            continue
        call = node if isinstance(node, ast.Call) else None
        if call is not None:
            pending += [*call.keywords, *call.args][::-1]
        while len(chain) > 1 and chain[0].attr in COMPONENT_ALIASES:
            del chain[0]
        is_stored = len(chain) == 1 and not isinstance(chain[0].ctx, ast.Load)
        path = tuple(attribute.attr for attribute in chain)
        yield Access(piece, function, path, tuple(chain), call, is_stored)


def _chain(node: ast.AST, self_name: str) -> list[ast.Attribute]:
    """Return the attributes from `self` on, or nothing when a node does not begin with `self`."""
    found: list[ast.Attribute] = []
    while isinstance(node, ast.Attribute):
        found.append(node)
        node = node.value
    return found[::-1] if isinstance(node, ast.Name) and node.id == self_name else []
