"""Give every name its meaning and report what breaks the rules of Slice.

The tree is walked in the order of the source, as a name must be declared before it is used. The rules are
those of the reference compiler; names may have underscores and may begin with `ice`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from codegen.diagnostics import Diagnostics, Note

from . import ast
from .codes import Code
from .composition import parts, why_not_a_key
from .constants import ConstantChecker
from .interface_checker import InterfaceChecker
from .name_rules import NameRules
from .resolver import Resolver, declared_kind, with_article

_DEEPEST_TYPE = 100


def check(root: ast.Module, diagnostics: Diagnostics) -> None:
    """Resolve the names of a translation unit in place and report what is wrong with it."""
    _Checker(diagnostics).check(root)


class _Checker:
    def __init__(self, diagnostics: Diagnostics) -> None:
        self._resolver = Resolver(diagnostics)
        self._names = NameRules(self._resolver)
        self._interfaces = InterfaceChecker(self._resolver, self._names)
        self._constants = ConstantChecker(self._resolver.symbols, diagnostics)
        self._depths: dict[str, int] = {}
        self._compact_ids: dict[str, ast.Class] = {}

    def check(self, root: ast.Module) -> None:
        """Check a translation unit."""
        self._module(root, "")
        self._resolver.finish()

    def _module(self, module: ast.Module, scope: str) -> None:
        """Check the definitions of a module or of the root."""
        for definition in module.definitions:
            if not scope and not isinstance(definition, ast.Module):
                message = f"{with_article(definition.kind)} can be defined only inside a module"
                self._resolver.error(Code.OUTSIDE_MODULE, message, definition.token)
            definition.scoped = f"{scope}::{definition.name}"
            self._names.metadata(definition)
            self._declare(definition, scope)
            self._definition(definition, scope)
        module.definitions[:] = [each for each in module.definitions if not each.local]

    def _declare(self, definition: ast.Definition, scope: str) -> None:
        """Make a name known in its scope, unless something else has it."""
        token = definition.token
        self._names.identifier(definition)
        before = self._resolver.symbols.get_any_case(definition.scoped)
        if before is None or self._may_follow(definition, before):
            enclosing = scope.rpartition("::")[2]
            nested = isinstance(definition, ast.Module | ast.Enumerator)
            if definition.name.lower() == enclosing.lower() and not nested:
                message = f"{definition.kind} `{definition.name}` has the name of the module around it"
                self._resolver.error(Code.REDEFINITION, message, token)
            if not (isinstance(definition, ast.ForwardDeclaration) and before is not None):
                self._resolver.symbols.add(definition)
            return
        first = Note(f"first defined here, as {before.kind}", before.token.location)
        if before.name == definition.name:
            self._resolver.error(Code.REDEFINITION, f"`{definition.name}` is defined again", token, first)
        else:
            message = f"`{definition.name}` differs only in capitalization from `{before.name}`"
            self._resolver.error(Code.CAPITALIZATION, message, token, first)
            self._resolver.symbols.add(definition)

    @staticmethod
    def _may_follow(definition: ast.Definition, before: ast.Definition) -> bool:
        """Return whether a second definition of a name only continues the first."""
        if before.name != definition.name:
            return False
        if isinstance(definition, ast.Module):
            return isinstance(before, ast.Module)
        same_kind = declared_kind(definition) is declared_kind(before)
        return same_kind and ast.ForwardDeclaration in {type(definition), type(before)}

    def _definition(self, definition: ast.Definition, scope: str) -> None:
        match definition:
            case ast.Module():
                self._module(definition, definition.scoped)
            case ast.Struct():
                self._members(definition.members, definition.scoped, scope)
                self._struct_in_itself(definition)
            case ast.Class() | ast.ExceptionType():
                if definition.base is not None:
                    self._resolver.base(definition.base, definition, scope)
                inherited = {
                    member.name.lower(): member for base in definition.ancestors() for member in base.members
                }
                self._members(definition.members, definition.scoped, scope, inherited)
                if isinstance(definition, ast.Class) and definition.compact_id is not None:
                    self._compact_id(definition, definition.compact_id)
            case ast.Interface():
                self._interfaces.check(definition, scope)
            case ast.Enumeration():
                for enumerator in definition.enumerators:
                    enumerator.scoped = f"{definition.scoped}::{enumerator.name}"
                    self._declare(enumerator, definition.scoped)
                self._constants.check_enumeration(definition, scope)
            case ast.Sequence():
                self._resolver.data_type(definition.element, scope)
            case ast.Dictionary():
                self._resolver.data_type(definition.key, scope)
                self._resolver.data_type(definition.value, scope)
                self._dictionary_key(definition)
            case ast.Constant():
                self._resolver.data_type(definition.type, scope)
                self._constants.check(definition.literal, definition.type, definition.name, scope)
        self._limit_depth(definition)

    def _struct_in_itself(self, struct: ast.Struct) -> None:
        for member in struct.members:
            if isinstance(member.type, ast.NamedType) and member.type.definition is struct:
                message = f"struct `{struct.name}` contains itself"
                self._resolver.error(Code.CONTAINS_ITSELF, message, member.type.token)
                member.type.definition = None

    def _dictionary_key(self, dictionary: ast.Dictionary) -> None:
        reason = why_not_a_key(dictionary.key)
        if reason:
            token = dictionary.key.token
            message = f"the key of dictionary `{dictionary.name}` {reason}"
            note = Note("a key is a bool, an integer, a string, an enumeration, or a struct of these")
            self._resolver.error(Code.BAD_DICTIONARY_KEY, message, token, note)

    def _limit_depth(self, definition: ast.Definition) -> None:
        """Report types that contain or extend others too deeply for those that walk them, here and later."""
        depth = 0
        for named in parts(definition):
            part = named.definition
            if part is None or isinstance(part, ast.ForwardDeclaration):
                continue
            if self._depths.get(part.scoped, 0) >= _DEEPEST_TYPE:
                message = (
                    f"`{named.name}` is nested too deeply: more than {_DEEPEST_TYPE} types in each other"
                )
                self._resolver.error(Code.TOO_DEEP, message, named.token)
                named.definition = None
            else:
                depth = max(depth, self._depths.get(part.scoped, 0))
        self._depths[definition.scoped] = depth + 1
        if isinstance(definition, ast.Interface):
            definition.generation = depth

    def _compact_id(self, definition: ast.Class, number: ast.Literal) -> None:
        other = self._compact_ids.setdefault(str(number.value), definition)
        if other is not definition:
            note = Note("first used here", other.token.location)
            message = f"the compact id {number.value} belongs to class `{other.name}`"
            self._resolver.error(Code.REDEFINITION, message, number.token, note)

    def _members(
        self,
        members: Sequence[ast.Member],
        owner: str,
        scope: str,
        inherited: Mapping[str, ast.Member] | None = None,
    ) -> None:
        self._names.unique(members, owner, inherited)
        for member in members:
            self._resolver.data_type(member.type, scope)
            if member.default is not None:
                self._constants.check(member.default, member.type, member.name, scope)
