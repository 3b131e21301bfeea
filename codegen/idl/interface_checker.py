"""The rules for interfaces, for what classes implement, and for their operations."""

from __future__ import annotations

from collections.abc import Sequence

from codegen.diagnostics import Note

from . import ast
from .codes import Code
from .constants import ConstantChecker
from .declarer import Declarer
from .locality import LocalityRules
from .member_checker import inherited_names
from .output_rules import check_generated_names
from .resolver import Resolver
from .symbols import Scope


class InterfaceChecker:
    """Resolves the names in interfaces and reports operations that break a rule."""

    def __init__(self, resolver: Resolver, declarer: Declarer, constants: ConstantChecker) -> None:
        self._resolver = resolver
        self._declarer = declarer
        self._constants = constants
        self._locality = LocalityRules(resolver)

    def bases(
        self, derived: ast.Interface | ast.Class, named: Sequence[ast.NamedType], scope: Scope
    ) -> list[ast.NamedType]:
        """Resolve the interfaces that are extended or implemented; return those that are good, each once."""
        good: dict[str, ast.NamedType] = {}
        for each in named:
            base = self._resolver.complete(each, ast.Interface, derived, scope)
            if base is not None:
                self._locality.bases(derived, [(base, each.token)])
                good.setdefault(base.scoped, each)
        return list(good.values())

    def inherited(self, derived: ast.Interface | ast.Class) -> dict[str, ast.Definition]:
        """Return what bases bring with them by name in lower case; report what two of them bring."""
        named = derived.bases if isinstance(derived, ast.Interface) else [derived.base, *derived.implements]
        bases = [each.definition for each in named if each is not None and each.definition is not None]
        brought: dict[str, ast.Definition] = {}
        for base in bases:
            for name, operation in inherited_names([base]).items():
                other = brought.setdefault(name, operation)
                if other is not operation and isinstance(operation, ast.Operation):
                    notes = [Note("one is here", other.token.location)]
                    notes.append(Note("the other is here", operation.token.location))
                    message = f"`{derived.name}` inherits `{operation.name}` from two unrelated interfaces"
                    self._resolver.error(Code.AMBIGUOUS_OPERATION, message, derived.token, *notes)
        return brought

    def operations(self, owner: ast.Interface, scope: Scope, inherited: dict[str, ast.Definition]) -> None:
        """Check the operations of an interface with the body `scope`."""
        for operation in owner.operations:
            self.operation(operation, owner, scope, inherited)
        self._stops(owner)
        check_generated_names(owner, inherited, self._resolver)

    def operation(
        self,
        operation: ast.Operation,
        owner: ast.Interface | ast.Class,
        scope: Scope,
        inherited: dict[str, ast.Definition],
    ) -> None:
        """Check an operation of an interface or a class."""
        if operation.return_tag is not None:
            self._constants.check_tag(operation.return_tag, scope)
        if operation.returns is not None:
            self._resolver.data_type(operation.returns, scope)
            self._locality.type(operation.returns, scope, f"what `{operation.name}` returns")
        new = self._declarer.declare_inside(operation, scope)
        self._declarer.inherited(operation, inherited)
        if operation.name.lower() == owner.name.lower():
            message = f"operation `{operation.name}` has the name of its {owner.kind}"
            self._resolver.error(Code.REDEFINITION, message, operation.token)
        operation.amd = operation.is_marked("amd") or owner.is_marked("amd")
        if operation.streamed and operation.returns is None and not operation.outputs:
            message = f"operation `{operation.name}` is streamed but returns nothing"
            self._resolver.error(Code.BAD_STREAM, message, operation.token)
        if new:
            self._resolver.introduce(operation.name, scope, operation.token, operation)
        self._parameters(operation, Scope(operation.scoped, scope.local))
        self._throws(operation, scope)

    def _stops(self, owner: ast.Interface) -> None:
        """Report stop operations that cannot be called without knowing more than the mark, or are several."""
        marked = [operation for operation in owner.operations if operation.stop]
        for operation in marked:
            if operation is not marked[0]:
                note = Note("the first is here", marked[0].token.location)
                message = f'`{owner.name}` has two operations marked ["stop"]; one is to stop it all'
                self._resolver.error(Code.BAD_STOP, message, operation.token, note)
            problems = []
            if operation.returns is not None or operation.outputs:
                problems.append("returns something")
            if any(parameter.tag is None for parameter in operation.inputs):
                problems.append("has a parameter that is not optional")
            if not operation.idempotent:
                problems.append("is not idempotent")
            if problems:
                message = f'operation `{operation.name}` is marked ["stop"] but {" and ".join(problems)}'
                self._resolver.error(Code.BAD_STOP, message, operation.token)

    def _parameters(self, operation: ast.Operation, scope: Scope) -> None:
        tags: dict[int, ast.Literal] = {}
        self._unique_tag(operation.return_tag, tags)
        before: ast.Parameter | None = None
        for parameter in operation.parameters:
            if parameter.tag is not None:
                self._constants.check_tag(parameter.tag, scope)
            if self._resolver.data_type(parameter.type, scope):
                self._locality.type(parameter.type, scope, f"parameter `{parameter.name}`")
                self._resolver.warn_of_deprecated_type(parameter.type)
            if self._declarer.declare_inside(parameter, scope):
                self._resolver.introduce(parameter.name, scope, parameter.token, parameter)
            if before is not None and before.out and not parameter.out:
                note = Note("the out parameter is here", before.token.location)
                message = f"in parameter `{parameter.name}` stands behind an out parameter"
                self._resolver.error(Code.OUT_BEFORE_IN, message, parameter.token, note)
            self._unique_tag(parameter.tag, tags)
            before = parameter

    def _unique_tag(self, tag: ast.Literal | None, tags: dict[int, ast.Literal]) -> None:
        if tag is None or not isinstance(tag.value, int):
            return
        first = tags.setdefault(tag.value, tag)
        if first is not tag:
            note = Note("first used here", first.token.location)
            message = f"tag {tag.value} is used twice in this operation"
            self._resolver.error(Code.BAD_TAG, message, tag.token, note)

    def _throws(self, operation: ast.Operation, scope: Scope) -> None:
        thrown: dict[str, ast.NamedType] = {}
        for named in operation.throws:
            exception = self._resolver.exception(named, scope, Code.BAD_THROWS)
            if exception is None:
                continue
            first = thrown.setdefault(exception.scoped, named)
            if first is not named:
                note = Note("it stands here already", first.token.location)
                message = f"`{named.name}` stands in `throws` twice"
                self._resolver.error(Code.BAD_THROWS, message, named.token, note)
            self._locality.thrown(exception, named, scope)
