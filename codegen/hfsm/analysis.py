"""Analyze the code of a document: parse every piece once, and find its places and what it uses.

The checks, the generator and the model checker use this analysis; none of them parses code. What the code
does, `effects` finds from it. Trees are shared, even between analyses of the same text, and must not be
changed.
"""

from __future__ import annotations

import ast
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Final, Literal, NamedTuple

from ..diagnostics import Location
from ..messages import Message
from ._extension import Extension, find_extension
from .code._scopes import INSPECTING, free_names, local_names
from .code.former import FormerNames, former_code
from .code.language import first_foreign
from .code.names import COMPONENT_ALIASES
from .code.text import (
    CodeError,
    CodeText,
    all_nodes,
    as_class,
    as_function,
    bound_names,
    child_nodes,
    dotted,
    own_nodes,
    parse,
    parse_expression,
    parse_import,
    refuse_code,
    refuse_functions,
    split,
)
from .document import Argument, Automaton, Document, Library, State, Text, Transition

_DEEPEST_TREE: Final = 150
"""The greatest depth of trees that are analyzed: the checks recurse into them."""


@dataclass(frozen=True, eq=False)
class Piece:
    """A piece of code. The lines of `tree` are those of `code` after `header` generated lines.

    If it `is_functions`, it becomes methods of the component; otherwise it becomes a function that shares the
    names of its automaton, and takes the event if it `has_event`. It `is_deep` if it is nested too deeply.
    `automaton` is the id of its automaton, 0 for functions outside of automata.
    """

    tree: ast.Module
    code: CodeText
    header: int
    path: Path
    automaton: int = 0
    is_functions: bool = False
    has_event: bool = False
    is_deep: bool = False

    def place(self, node: ast.AST, length: int = 0) -> Location:
        """Return the place of a node in its file; `length` is that of the text to underline."""
        line, offset = getattr(node, "lineno", 1), getattr(node, "col_offset", 0)
        if not length and getattr(node, "end_lineno", None) == line:
            inside, end = line - self.header, getattr(node, "end_col_offset", offset)
            length = self.code.column(inside, end) - self.code.column(inside, offset)
        return self.at(line, offset, length)

    def at(self, tree_line: int, offset: int, length: int = 1) -> Location:
        """Return the place in the file of a line of the tree and an offset in it, in bytes of UTF-8."""
        line = tree_line - self.header
        line, column = self.code.place(line, self.code.column(line, offset))
        return Location(self.path, line, column, max(1, length))

    def place_of_store(self, name: str) -> Location | None:
        """Return the first place where it assigns a name, in any scope, or None."""
        for node in ast.walk(self.tree):
            if isinstance(node, ast.Name) and node.id == name and isinstance(node.ctx, ast.Store):
                return self.place(node, len(name))
        return None

    @property
    def is_expression(self) -> bool:
        """Whether it is an expression, not statements."""
        return self.header > 0

    @property
    def expression(self) -> ast.expr | None:
        """The expression of a condition or an argument, None for statements."""
        match self.tree.body:
            case [ast.Expr(value=value)] | [ast.Return(value=ast.expr() as value)]:
                return value
        return None

    @cached_property
    def reads(self) -> frozenset[str]:
        """The names that it reads, in its scope or in nested ones."""
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
    def bound(self) -> frozenset[str]:
        """The names that it binds in its scope, except the event that it takes."""
        return bound_names(self.tree) - ({"event"} if self.has_event else set())

    @cached_property
    def used(self) -> frozenset[str]:
        """All names in it."""
        return frozenset(node.id for node in all_nodes(self.tree) if isinstance(node, ast.Name))

    @cached_property
    def free(self) -> frozenset[str]:
        """The names that it reads and does not bind; other code of its automaton may bind them."""
        source = (
            as_class(self.code) if self.is_functions else as_function(self.tree, self.code, self.header)[0]
        )
        return free_names(source)

    @cached_property
    def mentioned(self) -> frozenset[str]:
        """The attributes in it, of whatever object, and the strings, which may name one."""
        found: set[str] = set()
        for node in all_nodes(self.tree):
            match node:
                case ast.Attribute(attr=name) | ast.Constant(value=str(name)):
                    found.add(name)
        return frozenset(found)

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

    `function` is the enclosing function of the document, if any. `is_stored` is true if the first attribute
    itself is assigned or deleted.
    """

    piece: Piece
    function: str | None
    path: tuple[str, ...]
    node: ast.Attribute
    call: ast.Call | None
    is_stored: bool

    @property
    def name(self) -> str:
        """The first attribute."""
        return self.path[0]

    def place(self, index: int) -> Location:
        """Return the place of the name of an attribute of the path."""
        node: ast.expr = self.node
        for _ in self.path[index % len(self.path) + 1 :]:
            assert isinstance(node, ast.Attribute)
            node = node.value
        assert isinstance(node, ast.Attribute)
        start = (node.end_col_offset or 0) - len(node.attr.encode())
        return self.piece.at(node.end_lineno or node.lineno, start, len(node.attr))


Part = Literal["entry", "code", "exit", "argument", "guard", "fired"]
"""The part of an automaton that code belongs to: of a state, an argument, or a transition (its condition or
guard, and its code)."""


@dataclass(eq=False)
class AutomatonCode:
    """All code of an automaton. Cyclic code has a part and an owner: a state, argument or transition.

    It is `broken` if some of it is not valid Python or nested too deeply: the names that the rest may use are
    then unknown.
    """

    automaton: Automaton
    variables: Piece | None = None
    by_owner: dict[tuple[Part, int], Piece] = field(default_factory=dict)
    """The cyclic code, by its part and the `id` of its owner: a document in the editor may repeat numbers."""
    broken: bool = False

    @cached_property
    def results(self) -> frozenset[str]:
        """The variables that take outputs of automata below."""
        return frozenset(
            result.variable.text.strip()
            for state in self.automaton.states
            for result in (() if state.final else state.results)
        )

    def of(self, part: Part, owner: State | Argument | Transition) -> Piece | None:
        """Return a piece of cyclic code, or None."""
        return self.by_owner.get((part, id(owner)))

    def running(self) -> Iterator[Piece]:
        """Yield the pieces of cyclic code that can be analyzed."""
        return (piece for piece in self.by_owner.values() if not piece.is_deep)

    def sharing(self) -> Iterator[Piece]:
        """Yield the pieces that share the names of the automaton and can be analyzed."""
        if self.variables is not None and not self.variables.is_deep:
            yield self.variables
        yield from self.running()

    @cached_property
    def names(self) -> frozenset[str]:
        """The names of the automaton: inputs, outputs and variables, and what its code shares."""
        own = {*self.automaton.declared, *self.results}
        if self.variables is not None:
            own |= self.variables.bound
        return frozenset(own).union(*(self.shared_names(piece) for piece in self.running()))

    @property
    def own_names(self) -> frozenset[str]:
        """The names that its declarations or its code give a value, whatever takes an output."""
        own = {*self.automaton.declared}
        return frozenset(own).union(*(piece.bound for piece in self.sharing()))

    def first_value(self, name: str) -> ast.expr | None:
        """Return the expression that the variables first assign to a name, or None."""
        for node in () if self.variables is None else self.variables.tree.body:
            match node:
                case ast.Assign(targets=targets, value=value):
                    if any(isinstance(each, ast.Name) and each.id == name for each in targets):
                        return value
                case ast.AnnAssign(target=ast.Name(id=assigned), value=ast.expr() as value):
                    if assigned == name:
                        return value
        return None

    def shared_names(self, piece: Piece) -> frozenset[str]:
        """Return the names that a piece of cyclic code binds and shares with other code or cycles."""
        return piece.bound - self._local.get(piece, frozenset())

    @cached_property
    def _local(self) -> dict[Piece, frozenset[str]]:
        """The names that each piece binds only for itself, within one cycle."""
        outside = self.automaton.declared | self.results
        if self.variables is not None:
            outside |= self.variables.bound | self.variables.used
        uses = Counter(name for piece in self.by_owner.values() for name in piece.bound | piece.used)
        if not INSPECTING.isdisjoint(uses.keys() | outside):
            return {}
        own = {
            piece: frozenset(name for name in piece.bound - outside if uses[name] == 1)
            for piece in self.by_owner.values()
            if not piece.is_expression and not piece.is_deep
        }
        return {piece: local_names(piece.tree, names) for piece, names in own.items() if names}


class LibraryImport(NamedTuple):
    """A library as an import statement, with its tree."""

    library: Library
    statement: str
    node: ast.Import | ast.ImportFrom


class CodeProblem(NamedTuple):
    """An error in the code of a text in the file `path`."""

    text: Text
    path: Path
    error: CodeError


@dataclass(eq=False)
class Analysis:
    """The analysis of a `document` at `path` whose imports are resolved.

    `output` is the directory of its component, by default that of the document. Code in another language than
    Python is left out.
    """

    document: Document
    path: Path
    output: Path | None = None
    imports: list[LibraryImport] = field(default_factory=list)
    automata: list[AutomatonCode] = field(default_factory=list)
    all_functions: list[Piece] = field(default_factory=list)
    """Functions, in automata and outside of them."""
    problems: list[CodeProblem] = field(default_factory=list)
    """Errors that keep the code from running."""
    by_text: dict[int, tuple[Text, Path, Piece | None]] = field(default_factory=dict, repr=False)
    """All texts with code by their `id`, with their file and piece (None if it is not valid Python)."""

    def piece(self, text: Text) -> Piece | None:
        """Return the piece of code of a text, None if it is blank or not valid Python."""
        return self.by_text[id(text)][2] if id(text) in self.by_text else None

    def is_broken(self, text: Text) -> bool:
        """Return whether a text of the document is not valid Python."""
        return id(text) in self.by_text and self.by_text[id(text)][2] is None

    @cached_property
    def is_complete(self) -> bool:
        """Whether all code could be parsed and analyzed."""
        return all(piece is not None and not piece.is_deep for _, _, piece in self.by_text.values())

    @property
    def functions(self) -> list[Piece]:
        """The functions that can be analyzed."""
        return [piece for piece in self.all_functions if not piece.is_deep]

    @property
    def pieces(self) -> list[Piece]:
        """All code that can be analyzed: the functions, then the code of automata."""
        return [*self.functions, *(piece for code in self.automata for piece in code.sharing())]

    @cached_property
    def accesses(self) -> list[Access]:
        """Every use of the component in all code."""
        return [access for piece in self.pieces for access in piece.accesses]

    @cached_property
    def defined(self) -> frozenset[str]:
        """The attributes that functions, and other statements among them, define in the component."""
        return frozenset[str]().union(*(piece.bound for piece in self.functions))

    @cached_property
    def free(self) -> frozenset[str]:
        """The names that code takes from the file of the component."""
        found = set[str]().union(*(piece.free for piece in self.functions))
        for code in self.automata:
            bound = (code.automaton.declared | code.results).union(*(piece.bound for piece in code.sharing()))
            found |= set[str]().union(*(piece.free for piece in code.sharing())) - bound
        return frozenset(found)

    @cached_property
    def extension(self) -> Extension | None:
        """The hand-written base of the component."""
        return find_extension(self.path, self.output) if self.path.name else None

    @cached_property
    def libraries(self) -> dict[str, str]:
        """The names of all imported modules and their contents, also those of the original generators."""
        return {**self.old_names.modules, **self.imported}

    @cached_property
    def imported(self) -> dict[str, str]:
        """The names that the declared libraries bind, with their full names; `*` for those of `import *`."""
        return names_with({}, (each.node for each in self.imports))

    @cached_property
    def old_names(self) -> FormerNames:
        """The names that the code uses and only the original generators provided."""
        mentioned = frozenset[str]().union(*(piece.mentioned for piece in self.pieces))
        own = self.defined | {access.name for access in self.accesses if access.is_stored}
        if self.extension is not None:
            own |= self.extension.attributes
        return former_code().former_names(
            self.document, mentioned=mentioned, own=own, free=self.free, imported=self.imported.keys()
        )

    @cached_property
    def modules(self) -> frozenset[str]:
        """The modules that libraries and code import, dotted."""
        nodes: list[ast.AST] = [each.node for each in self.imports]
        nodes += (node for piece in self.pieces for node in all_nodes(piece.tree))
        found: set[str] = set()
        for node in nodes:
            if isinstance(node, ast.Import):
                found.update(alias.name for alias in node.names)
            elif isinstance(node, ast.ImportFrom):
                found.add(node.module or "")
        return frozenset(found)


def analyze(document: Document, path: Path, output: Path | None = None) -> Analysis:
    """Return the analysis of a document; `output` is the directory of its component."""
    analysis = Analysis(document, path, output)
    reader = _Reader(analysis)
    for library in document.libraries:
        reader.library(library)
    if first_foreign(document, path) is not None:
        return analysis
    for automaton in document.automata:
        analysis.automata.append(reader.automaton(automaton))
    for functions in document.functions:
        reader.functions(functions.text, functions.path)
    return analysis


def library_names(library: Library) -> dict[str, str]:
    """Return the names that a library binds, with their full names; none if it is not imported."""
    try:
        return imported_names(parse_import(library.name)[1]) if _is_imported(library) else {}
    except CodeError:
        return {}


def _is_imported(library: Library) -> bool:
    return library.kind == "module" and not library.name.is_blank


def imported_names(node: ast.Import | ast.ImportFrom) -> dict[str, str]:
    """Return the names that an import binds, with their full names."""
    if isinstance(node, ast.ImportFrom):
        return {alias.asname or alias.name: f"{node.module}.{alias.name}" for alias in node.names}
    return {
        alias.asname or alias.name.split(".")[0]: alias.name if alias.asname else alias.name.split(".")[0]
        for alias in node.names
    }


def names_with(libraries: Mapping[str, str], nodes: Iterable[ast.AST]) -> dict[str, str]:
    """Return the full names of libraries and of what nodes import, by name; `?` for a name of several."""
    names = dict(libraries)
    for node in nodes:
        if isinstance(node, ast.Import | ast.ImportFrom):
            for name, full in imported_names(node).items():
                names[name] = full if names.get(name, full) == full else "?"
    return names


_Kind = Literal["statements", "variables", "functions", "condition", "value"]
"""The kind of a text. Values are expressions; so are conditions, or they are statements that return."""


class _Reader:
    """Parse the pieces of an analysis, automaton by automaton."""

    def __init__(self, analysis: Analysis) -> None:
        self._analysis = analysis
        self._current: AutomatonCode | None = None

    def library(self, library: Library) -> None:
        if _is_imported(library):
            try:
                found = LibraryImport(library, *parse_import(library.name))
            except CodeError as error:
                self._add_problem(library.name, library.path, error)
            else:
                self._analysis.imports.append(found)

    def functions(self, text: Text, path: Path | None) -> None:
        piece = self._piece(text, path, "functions")
        self._analysis.all_functions += [] if piece is None else [piece]

    def automaton(self, automaton: Automaton) -> AutomatonCode:
        found = self._current = AutomatonCode(automaton)
        found.variables = self._piece(automaton.variables, automaton.path, "variables")
        self.functions(automaton.functions, automaton.path)
        for state in automaton.states:
            self._add("entry", state, state.entry)
            self._add("code", state, state.code)
            self._add("exit", state, state.exit)
            for argument in state.arguments:
                self._add("argument", argument, argument.value, "value")
        for transition in automaton.transitions:
            has_event = transition.type == "event"
            guard = transition.trigger if transition.type == "condition" else transition.guard
            self._add("guard", transition, guard, "condition", has_event=has_event)
            self._add("fired", transition, transition.code, has_event=has_event)
        self._current = None
        return found

    def _add(
        self,
        part: Part,
        owner: State | Argument | Transition,
        text: Text,
        kind: _Kind = "statements",
        *,
        has_event: bool = False,
    ) -> None:
        piece = self._piece(text, owner.path, kind, has_event=has_event)
        if piece is not None and self._current is not None:
            self._current.by_owner[part, id(owner)] = piece

    def _piece(self, text: Text, path: Path | None, kind: _Kind, *, has_event: bool = False) -> Piece | None:
        """Return a text as a piece of code, None if it is blank or not valid Python."""
        path = path or self._analysis.path
        if text.is_blank:
            if kind == "value":
                error = CodeError(Message("the value is empty"), text.line, text.column)
                self._add_problem(text, path, error)
            return None
        automaton = 0 if self._current is None else self._current.automaton.id
        read = _read if text.line else _read.__wrapped__  # texts without a place may be several
        piece, problem = read(text, text.line, text.column, path, kind, automaton, has_event)
        if problem is not None:
            self._add_problem(text, path, problem)
        self._analysis.by_text[id(text)] = (text, path, piece)
        if self._current is not None and (piece is None or piece.is_deep):
            self._current.broken = True
        return piece

    def _add_problem(self, text: Text, path: Path | None, error: CodeError) -> None:
        self._analysis.problems.append(CodeProblem(text, path or self._analysis.path, error))


@lru_cache(maxsize=8192)
def _read(
    text: Text, _line: int, _column: int, path: Path, kind: _Kind, automaton: int, has_event: bool
) -> tuple[Piece | None, CodeError | None]:
    """Return a text at its place in a file as a piece of code, and what is wrong with it."""
    code = split(text)
    assert code is not None
    piece = None
    try:
        tree, header = _parse(code, kind)
        is_functions, is_deep = kind == "functions", _is_too_deep(tree)
        piece = Piece(tree, code, header, path, automaton, is_functions, has_event, is_deep)
        if is_functions:
            refuse_functions(code)
        else:
            refuse_code(tree, code, header, is_variables=kind == "variables")
    except CodeError as error:
        return piece, error.with_traceback(None)
    return piece, None


def _parse(code: CodeText, kind: _Kind) -> tuple[ast.Module, int]:
    """Return the tree of a piece of code, and the number of generated lines before it. Raises CodeError."""
    if kind not in ("condition", "value"):
        return parse(code, code.lines), 0
    try:
        return parse_expression(code, Message("condition") if kind == "condition" else Message("value")), 1
    except CodeError:
        if kind == "value" or not any(re.search(r"\breturn\b", line) for line in code.lines):
            raise
    tree = parse(code, code.lines)
    if not any(isinstance(node, ast.Return) and node.value is not None for node in own_nodes(tree)):
        raise code.error(Message("a condition is one expression, or statements that return whether it holds"))
    return tree, 0


@lru_cache(maxsize=4096)
def _is_too_deep(tree: ast.AST) -> bool:
    level: list[ast.AST] = [tree]
    for _ in range(_DEEPEST_TREE):
        level = [child for node in level for child in child_nodes(node)]
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
            continue  # its methods have another `self`
        used = node.func if isinstance(node, ast.Call) else node
        name, *path = dotted(used) or [""]
        if name != self_name or not isinstance(used, ast.Attribute):
            pending += child_nodes(node)[::-1]
            continue
        call = node if isinstance(node, ast.Call) else None
        if call is not None:
            pending += [*call.keywords, *call.args][::-1]
        while len(path) > 1 and path[0] in COMPONENT_ALIASES:
            del path[0]
        is_stored = len(path) == 1 and not isinstance(used.ctx, ast.Load)
        yield Access(piece, function, tuple(path), used, call, is_stored)
