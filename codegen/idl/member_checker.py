"""The rules for structs, classes and exceptions and their members."""

from __future__ import annotations

from collections.abc import Iterable

from codegen.diagnostics import Note

from . import ast
from .codes import Code
from .constants import ConstantChecker
from .declarer import Declarer
from .locality import LocalityRules
from .resolver import Resolver
from .symbols import Scope


class MemberChecker:
    """Resolves the types and values of members and reports members that break a rule."""

    def __init__(self, resolver: Resolver, declarer: Declarer, constants: ConstantChecker) -> None:
        self._resolver = resolver
        self._declarer = declarer
        self._constants = constants
        self._locality = LocalityRules(resolver)

    def check(
        self,
        owner: ast.Struct | ast.Derivable,
        scope: Scope,
        inherited: dict[str, ast.Definition] | None = None,
    ) -> None:
        """Check the members of what has the body `scope`; `inherited` are names of bases in lower case."""
        tags: dict[int, ast.Member] = {}
        for member in owner.members:
            self.member(member, owner, scope, inherited or {}, tags)

    def member(
        self,
        member: ast.Member,
        owner: ast.Struct | ast.Derivable,
        scope: Scope,
        inherited: dict[str, ast.Definition],
        tags: dict[int, ast.Member],
    ) -> None:
        """Check a member; `tags` are those used so far."""
        if isinstance(owner, ast.Struct):
            self._no_tag(member)
        elif member.tag is not None:
            self._constants.check_tag(member.tag, scope)
        if not self._resolver.data_type(member.type, scope):
            self._declarer.declare_inside(member, scope)
            return
        if member.default is not None:
            self._constants.check_default(member, scope)
        new = self._declarer.declare_inside(member, scope)
        self._declarer.inherited(member, inherited)
        if isinstance(member.type, ast.NamedType) and member.type.definition is owner:
            self._not_in_itself(member.type, owner)
        self._locality.type(member.type, scope, f"member `{member.name}`")
        self._resolver.warn_of_deprecated_type(member.type)
        self._unique_tag(member, tags)
        if new:
            self._resolver.introduce(member.name, scope, member.token, member)

    def _not_in_itself(self, kind: ast.NamedType, owner: ast.Definition) -> None:
        if isinstance(owner, ast.Struct):
            message = f"struct `{owner.name}` contains itself"
            self._resolver.error(Code.CONTAINS_ITSELF, message, kind.token)
            kind.definition = None

    def bases_of_exception(self, exception: ast.ExceptionType, scope: Scope) -> None:
        """Resolve what an exception extends."""
        if exception.base is not None:
            base = self._resolver.exception(exception.base, scope, Code.WRONG_KIND)
            if base is not None:
                self._locality.bases(exception, [(base, exception.base.token)])

    def _no_tag(self, member: ast.Member) -> None:
        if member.tag is not None:
            message = f"member `{member.name}` is optional, which members of structs cannot be"
            note = Note("members of classes and exceptions can")
            self._resolver.error(Code.BAD_TAG, message, member.tag.token, note)

    def _unique_tag(self, member: ast.Member, tags: dict[int, ast.Member]) -> None:
        if member.tag is None or not isinstance(member.tag.value, int):
            return
        first = tags.setdefault(member.tag.value, member)
        if first is not member:
            note = Note("first used here", first.token.location)
            message = f"tag {member.tag.value} of `{member.name}` belongs to `{first.name}`"
            self._resolver.error(Code.BAD_TAG, message, member.tag.token, note)


def inherited_names(bases: Iterable[ast.Definition]) -> dict[str, ast.Definition]:
    """Return the members and operations of classes, interfaces and exceptions by name in lower case."""
    found: dict[str, ast.Definition] = {}
    for base in bases:
        if isinstance(base, ast.Interface):
            for interface in (base, *base.ancestors()):
                found |= {operation.name.lower(): operation for operation in interface.operations}
        elif isinstance(base, ast.Derivable):
            for derivable in (base, *base.ancestors()):
                found |= {member.name.lower(): member for member in derivable.members}
                if isinstance(derivable, ast.Class):
                    found |= {operation.name.lower(): operation for operation in derivable.operations}
                    found |= inherited_names(
                        named.definition for named in derivable.implements if named.definition is not None
                    )
    return found
