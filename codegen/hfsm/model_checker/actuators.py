"""What the code of an automaton commands: operations of interfaces that change something.

The code is not run: calls of functions of the document are followed, with the strings that are handed to
them, so that `getattr(self, f"{side}Motors")` is understood where `side` is known.
"""

from __future__ import annotations

import ast
import json
import re
import textwrap
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from ...diagnostics import Diagnostics, Location, Note
from ..code.trees import parse_python
from ..document import Document, Text

__all__ = ["Command", "Commands", "Operations", "is_command", "read_operations"]

_COMMANDS: Final = re.compile(r"(set|send|play|stop|start|move|turn|walk|go|do|reset|say|command)(?![a-z])")
_READS: Final = re.compile(r"(get|is|has|read|list|find|ice)(?![a-z])")
_DEEPEST: Final = 40

Operations = Mapping[str, Mapping[str, bool]]
"""Whether each operation commands something, by the plain name of its interface."""

Strings = Mapping[str, str]


@dataclass(frozen=True, slots=True)
class Command:
    """That a piece of code commands the servant `identity` by an operation of `self.<interface>`."""

    identity: str
    interface: str
    operation: str


def is_command(operation: str, idempotent: bool | None = None) -> bool:
    """Return whether an operation changes something, by its name and whether its IDL says `idempotent`."""
    if _COMMANDS.match(operation):
        return True
    return not _READS.match(operation) and idempotent is False


def read_operations(schemas: Iterable[Path], diagnostics: Diagnostics) -> dict[str, dict[str, bool]]:
    """Return the operations of interfaces from the `schema.json` files that codegen writes.

    A file that cannot be read, or is no such description, is reported as an error.
    """
    own: dict[str, dict[str, bool]] = {}
    bases: dict[str, list[str]] = {}
    for path in schemas:
        place, problem = Location(path), ""
        try:
            text = path.read_text(encoding="utf-8")
            diagnostics.add_source(path, text)
            for scoped, definition in json.loads(text)["definitions"].items():
                if definition["kind"] == "interface":
                    name = scoped.rsplit("::", 1)[-1]
                    bases[name] = [base.rsplit("::", 1)[-1] for base in definition.get("bases", ())]
                    own[name] = {
                        operation["name"]: is_command(operation["name"], operation.get("idempotent") is True)
                        for operation in definition.get("operations", ())
                    }
        except OSError as error:
            problem = f"cannot be read: {error.strerror or error}"
        except json.JSONDecodeError as error:
            place, problem = Location(path, error.lineno, error.colno), f"is no JSON: {error.msg}"
        except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
            problem = "is none that codegen writes"
        if problem:
            note = Note("the model checker needs it: undo a broken merge, or generate the package again")
            diagnostics.error(
                "E605", f"the description of package `{path.parent.name}` {problem}", place, [note]
            )
    return {name: _with_bases(name, own, bases, 0) for name in own}


def _with_bases(
    name: str, own: Mapping[str, dict[str, bool]], bases: Mapping[str, list[str]], depth: int
) -> dict[str, bool]:
    found: dict[str, bool] = {}
    for base in bases.get(name, ()) if depth < _DEEPEST else ():
        found |= _with_bases(base, own, bases, depth + 1)
    return found | own.get(name, {})


@dataclass
class Commands:
    """What the code of a document commands, by piece of code."""

    document: Document
    operations: Operations = field(default_factory=dict)
    _interfaces: dict[str, tuple[str, str]] = field(init=False, repr=False)
    _functions: dict[str, ast.FunctionDef] = field(init=False, repr=False)
    _known: dict[tuple[str, tuple[tuple[str, str], ...]], frozenset[Command]] = field(
        default_factory=dict, init=False, repr=False
    )

    def __post_init__(self) -> None:
        self._interfaces = {
            interface.name: (interface.identity, interface.type.replace(".", "::").rsplit("::", 1)[-1])
            for interface in self.document.interfaces
        }
        for alias, name in self.document.proxy_aliases.items():
            self._interfaces.setdefault(alias, self._interfaces[name])
        self._functions = {}
        automata = self.document.automata
        for text in (*(a.functions for a in automata), *(f.text for f in self.document.functions)):
            tree = _parsed(text)
            for node in tree.body if tree else ():
                if isinstance(node, ast.FunctionDef):
                    self._functions[node.name] = node

    def of(self, piece: Text, aliases: Strings | None = None) -> frozenset[Command]:
        """Return what a piece of code certainly names as commanded, itself or by the functions it calls.

        `aliases` are variables that hold proxies: the attribute of `self` by the name.
        """
        if piece.is_blank or not self._interfaces:
            return frozenset()
        tree = _parsed(piece)
        return frozenset() if tree is None else frozenset(self._in(tree, {}, aliases or {}, 0))

    def aliases(self, variables: Text) -> dict[str, str]:
        """Return the variables that are set to a proxy, with the attribute of `self`."""
        tree = _parsed(variables)
        return {} if tree is None else self._aliases(tree, {})

    def _aliases(self, tree: ast.AST, strings: Strings) -> dict[str, str]:
        found: dict[str, str] = {}
        for node in ast.walk(tree):
            if isinstance(node, ast.Assign):
                attribute = self._proxy(node.value, strings, {})
                if attribute is not None:
                    found |= {target.id: attribute for target in node.targets if isinstance(target, ast.Name)}
        return found

    def _in(self, tree: ast.AST, strings: Strings, outer: Strings, depth: int) -> Iterator[Command]:
        aliases = {**outer, **self._aliases(tree, strings)}
        for node in ast.walk(tree):
            if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Attribute):
                continue
            attribute = self._proxy(node.func.value, strings, aliases)
            if attribute is not None:
                command = self._command(attribute, node.func.attr)
                if command is not None:
                    yield command
            elif _is_self(node.func.value) and node.func.attr in self._functions and depth < _DEEPEST:
                yield from self._called(self._functions[node.func.attr], node, strings, depth)

    def _called(
        self, function: ast.FunctionDef, call: ast.Call, strings: Strings, depth: int
    ) -> frozenset[Command]:
        handed: dict[str, str] = {}
        names = [argument.arg for argument in (*function.args.posonlyargs, *function.args.args)][1:]
        given = [*zip(names, call.args, strict=False)]
        given += [(keyword.arg, keyword.value) for keyword in call.keywords if keyword.arg is not None]
        for name, value in given:
            string = _string(value, strings)
            if string is not None:
                handed[name] = string
        key = function.name, tuple(sorted(handed.items()))
        if key not in self._known:
            self._known[key] = frozenset()  # a function that calls itself adds nothing
            self._known[key] = frozenset(self._in(function, handed, {}, depth + 1))
        return self._known[key]

    def _proxy(self, node: ast.expr, strings: Strings, aliases: Strings) -> str | None:
        """Return the attribute of `self` that holds the proxy which an expression certainly is."""
        name: str | None = None
        if isinstance(node, ast.Attribute) and _is_self(node.value):
            name = node.attr
        elif isinstance(node, ast.Name):
            name = aliases.get(node.id)
        elif _is_getattr(node) and isinstance(node, ast.Call):
            name = _string(node.args[1], strings)
        return name if name in self._interfaces else None

    def _command(self, attribute: str, method: str) -> Command | None:
        identity, kind = self._interfaces[attribute]
        known = self.operations.get(kind, {})
        operation = method if method in known else method.removesuffix("Async")
        commands = known[operation] if operation in known else is_command(operation)
        return Command(identity, attribute, operation) if commands else None


def _is_self(node: ast.expr) -> bool:
    return isinstance(node, ast.Name) and node.id == "self"


def _is_getattr(node: ast.expr) -> bool:
    return (
        isinstance(node, ast.Call)
        and isinstance(node.func, ast.Name)
        and node.func.id == "getattr"
        and len(node.args) >= 2
        and _is_self(node.args[0])
    )


def _string(node: ast.expr, strings: Strings) -> str | None:
    """Return the string that an expression certainly is, or None."""
    if isinstance(node, ast.Constant):
        return node.value if isinstance(node.value, str) else None
    if isinstance(node, ast.Name):
        return strings.get(node.id)
    if isinstance(node, ast.JoinedStr):
        parts = [_string(part, strings) for part in node.values]
        known = [part for part in parts if part is not None]
        return "".join(known) if len(known) == len(parts) else None
    if isinstance(node, ast.FormattedValue):
        plain = node.conversion == -1 and node.format_spec is None
        return _string(node.value, strings) if plain else None
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        left, right = _string(node.left, strings), _string(node.right, strings)
        return None if left is None or right is None else left + right
    return None


def _parsed(text: Text) -> ast.Module | None:
    try:
        return parse_python(textwrap.dedent(text.text))
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return None
