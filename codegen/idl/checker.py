"""Give every name its meaning and report what breaks the rules of Slice.

The tree is walked in the order of the source, as a name must be declared before it is used. The rules are
those of the reference compiler, slice2py of Ice 3.7.
"""

from __future__ import annotations

from codegen.diagnostics import Diagnostics, Note

from . import ast
from .codes import Code
from .composition import holds_sequence, parts, why_not_a_key
from .constants import ConstantChecker
from .declarer import Declarer
from .interface_checker import InterfaceChecker
from .locality import LocalityRules
from .member_checker import MemberChecker, inherited_names
from .resolver import Resolver
from .symbols import Scope

_DEEPEST_TYPE = 100


def check(root: ast.Module, diagnostics: Diagnostics) -> None:
    """Resolve the names of a translation unit in place and report what is wrong with it.

    Local definitions are checked like the others and then taken out of the tree, with a note.
    """
    _Checker(diagnostics).check(root)


class _Checker:
    def __init__(self, diagnostics: Diagnostics) -> None:
        self._resolver = Resolver(diagnostics)
        self._declarer = Declarer(self._resolver)
        self._constants = ConstantChecker(self._resolver)
        self._members = MemberChecker(self._resolver, self._declarer, self._constants)
        self._interfaces = InterfaceChecker(self._resolver, self._declarer, self._constants)
        self._locality = LocalityRules(self._resolver)
        self._depths: dict[str, int] = {}
        self._compact_ids: dict[int, ast.Class] = {}

    def check(self, root: ast.Module) -> None:
        """Check a translation unit."""
        self._resolver.symbols.expect(root)
        self._module(root, Scope())
        self._resolver.finish()
        self._drop_local(root)

    def _module(self, module: ast.Module, scope: Scope) -> None:
        """Check the definitions of a module or of the root, whose body is `scope`."""
        for definition in module.definitions:
            self._definition(definition, scope)
            self._limit_depth(definition)

    def _definition(self, definition: ast.Definition, scope: Scope) -> None:
        match definition:
            case ast.Module():
                self._members_of_module(definition, scope)
            case ast.ForwardDeclaration():
                new = self._declarer.declare(definition, scope)
                if new and definition.of is ast.Interface:
                    self._resolver.introduce(definition.name, scope, definition.token, definition)
            case ast.Struct():
                self._members.check(definition, self._body(definition, scope))
            case ast.ExceptionType():
                self._members.bases_of_exception(definition, scope)
                inherited = inherited_names(definition.ancestors())
                self._members.check(definition, self._body(definition, scope), inherited)
            case ast.Class():
                self._class(definition, scope)
            case ast.Interface():
                definition.bases = self._interfaces.bases(definition, definition.bases, scope)
                body = self._body(definition, scope)
                self._interfaces.operations(definition, body, self._interfaces.inherited(definition))
            case ast.Enumeration():
                body = self._body(definition, scope)
                for enumerator in definition.enumerators:
                    self._constants.check_enumerator_value(enumerator, body)
                    self._declarer.declare_inside(enumerator, body)
                self._constants.number_enumerators(definition)
            case ast.Sequence():
                self._resolver.data_type(definition.element, scope)
                self._declarer.declare(definition, scope)
                own = Scope(scope.name, definition.local)
                self._locality.type(definition.element, own, f"the elements of `{definition.name}`")
                self._resolver.warn_of_deprecated_type(definition.element)
            case ast.Dictionary():
                self._dictionary(definition, scope)
            case ast.Constant():
                if self._resolver.data_type(definition.type, scope):
                    self._constants.check_constant(definition, scope)
                self._declarer.declare(definition, scope)

    def _body(self, definition: ast.Definition, scope: Scope) -> Scope:
        """Declare a definition and return the scope of its body."""
        if self._declarer.declare(definition, scope):
            self._resolver.introduce(definition.name, scope, definition.token, definition)
            return Scope(definition.scoped, definition.local)
        return Scope(f"{definition.scoped} (again)", definition.local)

    def _members_of_module(self, module: ast.Module, scope: Scope) -> None:
        if self._declarer.declare(module, scope):
            self._resolver.introduce(module.name, scope, module.token, module)
        self._module(module, Scope(module.scoped))

    def _class(self, definition: ast.Class, scope: Scope) -> None:
        if definition.compact_id is not None:
            self._constants.check_compact_id(definition.compact_id, scope)
        if definition.base is not None:
            base = self._resolver.base(definition.base, definition, scope)
            if base is not None:
                self._locality.bases(definition, [(base, definition.base.token)])
        definition.implements = self._interfaces.bases(definition, definition.implements, scope)
        body = self._body(definition, scope)
        inherited = self._interfaces.inherited(definition)
        tags: dict[int, ast.Member] = {}
        for item in sorted((*definition.members, *definition.operations), key=lambda each: each.token.offset):
            if isinstance(item, ast.Member):
                self._members.member(item, definition, body, inherited, tags)
            elif isinstance(item, ast.Operation):
                self._interfaces.operation(item, definition, body, inherited)
        if definition.compact_id is not None:
            self._unique_compact_id(definition, definition.compact_id)
        if (definition.implements or definition.operations) and not definition.local:
            what = "operations" if definition.operations else "implemented interfaces"
            message = f"{what} of a class are deprecated and left out; an interface can have operations"
            self._resolver.warning(Code.DEPRECATED, message, definition.token)

    def _unique_compact_id(self, definition: ast.Class, number: ast.Literal) -> None:
        if not isinstance(number.value, int):
            return
        other = self._compact_ids.setdefault(number.value, definition)
        if other is not definition:
            note = Note("first used here", other.token.location)
            message = f"the compact id {number.value} belongs to class `{other.name}`"
            self._resolver.error(Code.BAD_TAG, message, number.token, note)

    def _dictionary(self, dictionary: ast.Dictionary, scope: Scope) -> None:
        key = self._resolver.data_type(dictionary.key, scope)
        value = self._resolver.data_type(dictionary.value, scope)
        self._declarer.declare(dictionary, scope)
        own = Scope(scope.name, dictionary.local)
        if key:
            self._dictionary_key(dictionary)
            self._locality.type(dictionary.key, own, f"the keys of `{dictionary.name}`")
        if value:
            self._locality.type(dictionary.value, own, f"the values of `{dictionary.name}`")
            self._resolver.warn_of_deprecated_type(dictionary.value)

    def _dictionary_key(self, dictionary: ast.Dictionary) -> None:
        reason = why_not_a_key(dictionary.key)
        token = dictionary.key.token
        if reason:
            message = f"the key of dictionary `{dictionary.name}` {reason}"
            note = Note("a key is a bool, an integer, a string, an enumeration, or a struct of these")
            self._resolver.error(Code.BAD_DICTIONARY_KEY, message, token, note)
        elif holds_sequence(dictionary.key):
            message = f"sequences in the key of dictionary `{dictionary.name}` are deprecated"
            self._resolver.warning(Code.DEPRECATED, message, token)

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

    def _drop_local(self, module: ast.Module) -> None:
        """Take local definitions out of the tree."""
        kept: list[ast.Definition] = []
        for definition in module.definitions:
            if isinstance(definition, ast.Module):
                self._drop_local(definition)
            if definition.local:
                if not isinstance(definition, ast.ForwardDeclaration):
                    message = f"local {definition.kind} `{definition.name}` is left out: it never travels"
                    self._resolver.note(Code.LOCAL_LEFT_OUT, message, definition.token)
            else:
                kept.append(definition)
        module.definitions = kept
