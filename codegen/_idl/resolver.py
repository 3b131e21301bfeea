"""Resolve names: declare definitions in scopes, find the definition of a name, and report errors."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import chain, islice

from codegen.diagnostics import Diagnostics, Note, did_you_mean

from . import ast
from .lexer import Token
from .report import Code, SourceReport, note_at

# Searching similar names is slow; after this many undefined names there are no more suggestions.
_MOST_PROPOSALS = 30
_MOST_CANDIDATES = 3000

_DATA_TYPES = (ast.Struct, ast.Class, ast.Interface, ast.Enumeration, ast.Sequence, ast.Dictionary)
_DECLARABLE = (ast.Interface, ast.Class)

Kinds = tuple[type[ast.Definition], ...]


@dataclass(slots=True, eq=False)
class Scope:
    """A body in the source in which names are looked up; a module has one each time it is opened."""

    name: str = ""
    """The scoped name of the definition with this body: `::jderobot`; empty for the root."""
    introduced: dict[str, tuple[ast.Definition, Token]] = field(default_factory=dict)
    """The meaning of each name, in lower case, and the token of its first use or declaration."""
    local: bool = False
    """The right to use types that are never sent."""


def _enclosing_scopes(scope: str) -> Iterator[str]:
    """Yield `::a::b`, `::a` and the root's empty name for the scope `::a::b`."""
    while scope:
        yield scope
        scope = scope.rpartition("::")[0]
    yield ""


class Symbols:
    """Definitions by scoped name, ignoring case: in Slice names must not differ only in case."""

    def __init__(self) -> None:
        self._by_lower_case: dict[str, ast.Definition] = {}
        self._enumerators: defaultdict[str, list[ast.Enumerator]] = defaultdict(list)
        self._expected: dict[str, ast.Definition] = {}
        self._proposals = 0

    def get(self, scoped: str) -> ast.Definition | None:
        """Return the first definition whose scoped name is equal to `scoped`, ignoring case."""
        return self._by_lower_case.get(scoped.lower())

    def add(self, definition: ast.Definition) -> None:
        """Add a definition under its scoped name; it replaces a forward declaration."""
        key = definition.scoped.lower()
        if isinstance(self._by_lower_case.get(key), ast.ForwardDeclaration):
            self._by_lower_case[key] = definition
        self._by_lower_case.setdefault(key, definition)
        if isinstance(definition, ast.Enumerator):
            enumeration, _, name = key.rpartition("::")
            container = enumeration.rpartition("::")[0]
            self._enumerators[f"{container}::{name}"].append(definition)

    def candidates(self, name: str, scope: str) -> Iterator[tuple[ast.Definition, str]]:
        """Yield the possible meanings of `name` in `scope`, the innermost first, with their scoped names."""
        for outer in ("",) if name.startswith("::") else _enclosing_scopes(scope):
            expected = f"{outer}::{name.removeprefix('::')}"
            definition = self._by_lower_case.get(expected.lower())
            if definition is not None:
                yield definition, expected

    def find(self, name: str, scope: str) -> ast.Definition | None:
        """Return the meaning of `name` in `scope`, ignoring case."""
        return next((definition for definition, _ in self.candidates(name, scope)), None)

    def enumerators(self, name: str, scope: str) -> list[ast.Enumerator]:
        """Return the enumerators that `name` could mean without the name of their enumeration."""
        container, separator, last = name.rpartition("::")
        scopes = _enclosing_scopes(scope)
        if separator:
            found = self.find(container, scope)
            scopes = iter([found.scoped] if found else [])
        for each in scopes:
            enumerators = self._enumerators.get(f"{each}::{last}".lower())
            if enumerators:
                return enumerators
        return []

    def expect(self, module: ast.Module) -> None:
        """Remember the definitions of a module, to explain errors when they are used too early."""
        for definition in module.definitions:
            self._expected.setdefault(definition.name, definition)
            if isinstance(definition, ast.Module):
                self.expect(definition)

    def help(self, name: str, scope: str, kinds: Kinds, also: Iterable[str] = ()) -> tuple[Note, ...]:
        """Return notes about an undefined name: it is defined later, or there is a similar name.

        Suggestions are names of one of `kinds`, and those in `also`.
        """
        later = self._expected.get(name.rpartition("::")[2])
        if later is not None and not later.scoped and isinstance(later, kinds):
            return (note_at("it is defined here, but must be defined before it is used", later.token),)
        if self._proposals == _MOST_PROPOSALS:
            return ()
        self._proposals += 1
        candidates = list(islice(chain(also, self._spellings(scope, kinds)), _MOST_CANDIDATES))
        last = name.rpartition("::")[2]
        elsewhere = [candidate for candidate in candidates if candidate.endswith(f"::{last}")]
        return did_you_mean(elsewhere[0] if elsewhere else name, candidates)

    def _spellings(self, scope: str, kinds: Kinds) -> Iterator[str]:
        """Yield every declared name of some kinds as it can be written in `scope`."""
        for definition in self._by_lower_case.values():
            if not issubclass(declared_kind(definition), kinds):
                continue
            for outer in _enclosing_scopes(scope):
                if definition.scoped.startswith(f"{outer}::"):
                    yield definition.scoped.removeprefix(f"{outer}::")
                    break


class Resolver:
    """The names of a translation unit as far as it has been walked, and its errors."""

    def __init__(self, diagnostics: Diagnostics) -> None:
        self.symbols = Symbols()
        self.report = SourceReport(diagnostics)
        self._named_types: list[ast.NamedType] = []

    # Declarations

    def declare(self, definition: ast.Definition, scope: Scope) -> bool:
        """Declare a definition in a module or the root; return whether its name is unique."""
        definition.scoped = f"{scope.name}::{definition.name}"
        if not scope.name and not isinstance(definition, ast.Module):
            message = f"{with_article(declared_kind(definition).kind)} can be defined only inside a module"
            self.report.error(Code.OUTSIDE_MODULE, message, definition.token)
        before = self.symbols.get(definition.scoped)
        if before is not None and not self._may_follow(definition, before):
            return False
        self._report_name_of_enclosing_module(definition, scope)
        if before is None or not isinstance(definition, ast.ForwardDeclaration):
            self.symbols.add(definition)
        return True

    def declare_inside(self, definition: ast.Definition, scope: Scope) -> bool:
        """Declare a member, an operation, a parameter or an enumerator; return whether its name is new."""
        definition.scoped = f"{scope.name}::{definition.name}"
        before = self.symbols.get(definition.scoped)
        if before is not None:
            self._report_taken(definition, before)
            return False
        self.symbols.add(definition)
        return True

    def report_inherited(self, definition: ast.Definition, inherited: dict[str, ast.Definition]) -> None:
        """Report a member or operation whose name is inherited; `inherited` has names in lower case."""
        base = inherited.get(definition.name.lower())
        if base is None:
            return
        note = note_at("first defined here", base.token)
        self._report_same_name(definition, base, note, "is already inherited", "the inherited ")

    def _may_follow(self, definition: ast.Definition, before: ast.Definition) -> bool:
        """Return whether a second definition of a name continues the first one, or report an error."""
        if isinstance(definition, ast.Module) and isinstance(before, ast.Module):
            if before.name == definition.name:
                return True
        elif declared_kind(definition) in _DECLARABLE and declared_kind(before) in _DECLARABLE:
            note = note_at("first declared here", before.token)
            if declared_kind(definition) is not declared_kind(before):
                message = f"`{definition.name}` was declared as {with_article(declared_kind(before).kind)}"
                self.report.error(Code.REDEFINITION, message, definition.token, note)
                return False
            if definition.local != before.local:
                message = f"`{definition.name}` is local in only one of its declarations"
                self.report.error(Code.REDEFINITION, message, definition.token, note)
                return False
            if ast.ForwardDeclaration in {type(definition), type(before)}:
                if before.name != definition.name:
                    message = f"`{definition.name}` differs only in case from `{before.name}`"
                    self.report.warning(Code.DOUBTFUL_CAPITALIZATION, message, definition.token, note)
                return True
        self._report_taken(definition, before)
        return False

    def _report_taken(self, definition: ast.Definition, before: ast.Definition) -> None:
        kind = declared_kind(before).kind
        note = note_at(f"first defined here, as {with_article(kind)}", before.token)
        self._report_same_name(definition, before, note, "is defined again")

    def _report_same_name(
        self, definition: ast.Definition, before: ast.Definition, note: Note, problem: str, which: str = ""
    ) -> None:
        """Report a name that is equal to another one, or differs only in case."""
        name = f"{declared_kind(definition).kind} `{definition.name}`"
        if before.name == definition.name:
            self.report.error(Code.REDEFINITION, f"{name} {problem}", definition.token, note)
        else:
            message = f"{name} differs only in case from {which}`{before.name}`"
            self.report.error(Code.CAPITALIZATION, message, definition.token, note)

    def _report_name_of_enclosing_module(self, definition: ast.Definition, scope: Scope) -> None:
        for module in scope.name.split("::"):
            if module.lower() == definition.name.lower():
                what = declared_kind(definition).kind
                message = f"{what} `{definition.name}` has the name of an enclosing module"
                self.report.error(Code.REDEFINITION, message, definition.token)
                return

    # Types

    def data_type(self, kind: ast.Type, scope: Scope) -> bool:
        """Resolve the type of data; return whether it is known."""
        if isinstance(kind, ast.ProxyType):
            return self._proxy(kind, scope)
        known = isinstance(kind, ast.BuiltinType) or self._type(kind, scope)
        if known and not scope.local and ast.is_local(kind):
            self.report.error(Code.LOCAL, f"`{kind.name}` is local: it is never sent", kind.token)
        return known

    def _proxy(self, kind: ast.ProxyType, scope: Scope) -> bool:
        target = kind.target
        if isinstance(target, ast.BuiltinType):
            return True
        if not self._type(target, scope, _DECLARABLE):
            return False
        definition = target.definition
        if definition is None or not issubclass(declared_kind(definition), _DECLARABLE):
            self._wrong_kind(Code.WRONG_KIND, target, "an interface")
            return False
        if definition.local:
            self.report.error(Code.LOCAL, f"`{target.name}` is local: it has no proxies", target.token)
        return True

    def _type(self, named: ast.NamedType, scope: Scope, proposed: Kinds = _DATA_TYPES) -> bool:
        """Look up a type; a definition in an inner scope that is not a type does not hide an outer type.

        `proposed` are the kinds of definitions to suggest for an undefined name.
        """
        wrong: ast.Definition | None = None
        for definition, expected in self.symbols.candidates(named.name, scope.name):
            kind = declared_kind(definition)
            if issubclass(kind, _DATA_TYPES):
                self._found(named, definition, expected, scope)
                return True
            wrong = wrong or definition
            if kind is ast.ExceptionType:
                break
        if wrong is None:
            self._undefined(named, scope, proposed)
        else:
            named.definition = wrong
            self._wrong_kind(Code.WRONG_KIND, named, "a type of data")
        return False

    def warn_of_deprecated_type(self, kind: ast.Type) -> None:
        """Warn about interfaces by value and proxies for classes."""
        target = kind.target if isinstance(kind, ast.ProxyType) else kind
        if not isinstance(target, ast.NamedType) or target.definition is None:
            return
        declared = declared_kind(target.definition)
        if target is kind and declared is ast.Interface and not target.definition.local:
            message = f"interface `{target.name}` by value is deprecated; `{target.name}*` is its proxy"
            self.report.warning(Code.DEPRECATED, message, target.token)
        if target is not kind and declared is ast.Class:
            message = f"`{target.name}*`, a proxy for a class, is deprecated"
            self.report.warning(Code.DEPRECATED, message, target.token)

    # Bases and exceptions

    def complete(
        self, named: ast.NamedType, wanted: type[ast.Definition], derived: ast.Definition, scope: Scope
    ) -> ast.Definition | None:
        """Resolve a class or interface of the expected kind, which must be defined, not only declared."""
        if named.name.removeprefix("::") in {derived.name, derived.scoped.removeprefix("::")}:
            found = self.symbols.find(named.name, scope.name)
            if found is None or found.scoped == derived.scoped:
                message = f"{derived.kind} `{derived.name}` extends itself"
                self.report.error(Code.BAD_INHERITANCE, message, named.token)
                return None
        if not self._type(named, scope, (wanted,)):
            return None
        definition = named.definition
        if definition is None or declared_kind(definition) is not wanted:
            self._wrong_kind(Code.WRONG_KIND, named, with_article(wanted.kind))
            return None
        if isinstance(definition, ast.ForwardDeclaration):
            note = note_at("declared here", definition.token)
            message = f"`{named.name}` is declared but not defined yet"
            self.report.error(Code.BAD_INHERITANCE, message, named.token, note)
            named.definition = None
            return None
        if definition.local != derived.local:
            which = "local" if definition.local else "not local"
            message = f"`{named.name}` is {which}, unlike `{derived.name}`, which extends it"
            self.report.error(Code.LOCAL, message, named.token)
        return definition

    def exception(self, named: ast.NamedType, scope: Scope, code: Code) -> ast.ExceptionType | None:
        """Resolve an exception that is thrown or extended."""
        for definition, expected in self.symbols.candidates(named.name, scope.name):
            if isinstance(definition, ast.ExceptionType):
                self._found(named, definition, expected, scope)
                return definition
            named.definition = definition
            self._wrong_kind(code, named, "an exception")
            return None
        self._undefined(named, scope, (ast.ExceptionType,))
        return None

    def _found(self, named: ast.NamedType, definition: ast.Definition, expected: str, scope: Scope) -> None:
        named.definition = definition
        self._named_types.append(named)
        if definition.scoped != expected:
            message = f"`{named.name}` differs only in case from `{definition.scoped}`"
            note = note_at("defined here", definition.token)
            self.report.error(Code.CAPITALIZATION, message, named.token, note)
        self.introduce(named.name, scope, named.token)

    def _undefined(self, named: ast.NamedType, scope: Scope, kinds: Kinds) -> None:
        builtin = ast.BUILTIN_TYPES if ast.Struct in kinds else ()
        notes = self.symbols.help(named.name, scope.name, kinds, builtin)
        self.report.error(Code.UNDEFINED_NAME, f"`{named.name}` is not defined", named.token, *notes)

    def _wrong_kind(self, code: Code, named: ast.NamedType, wanted: str) -> None:
        found = named.definition
        if found is not None:
            note = note_at(f"`{found.name}` is defined here", found.token)
            message = f"`{named.name}` is {with_article(declared_kind(found).kind)}, not {wanted}"
            self.report.error(code, message, named.token, note)
        named.definition = None

    # Meanings

    def introduce(
        self, name: str, scope: Scope, token: Token, definition: ast.Definition | None = None
    ) -> None:
        """Fix the meaning of a name in a scope at its first use or declaration.

        For `A::B` this is the meaning of `A`. Names of members and parameters are separate from those of
        types. `definition` is the meaning of the whole name, which is looked up if it is None.
        """
        first, _, rest = name.partition("::")
        if not first:
            return
        if definition is None or rest:
            definition = self.symbols.find(first, scope.name)
        if definition is None:
            return
        before, since = scope.introduced.setdefault(first.lower(), (definition, token))
        if before.scoped == definition.scoped:
            return
        for apart in (ast.Parameter, ast.Member):
            if isinstance(before, apart) != isinstance(definition, apart):
                return
        note = note_at(f"it means `{before.scoped}` here", since)
        self.report.error(Code.CHANGED_MEANING, f"`{first}` changes its meaning in this scope", token, note)

    def finish(self) -> None:
        """Replace forward declarations by their definitions."""
        for named in self._named_types:
            if isinstance(named.definition, ast.ForwardDeclaration):
                named.definition = self.symbols.get(named.definition.scoped)
                if isinstance(named.definition, ast.ForwardDeclaration):
                    self._never_defined(named, named.definition)

    def _never_defined(self, named: ast.NamedType, declaration: ast.ForwardDeclaration) -> None:
        if declaration.of is ast.Class:
            note = note_at("declared here", declaration.token)
            message = f"`{named.name}` is declared but not defined in any file included here"
            self.report.warning(Code.NEVER_DEFINED, message, named.token, note)


def with_article(noun: str) -> str:
    """Return a noun with `a` or `an`."""
    return f"{'an' if noun[0] in 'aeiou' else 'a'} {noun}"


def declared_kind(definition: ast.Definition) -> type[ast.Definition]:
    """Return the kind of a definition, or that of a forward declaration's definition."""
    return definition.of if isinstance(definition, ast.ForwardDeclaration) else type(definition)
