"""Write data types: structs, classes, exceptions, enumerations, sequences, dictionaries and constants."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from . import ast
from .doc_comments import parse_doc_comment
from .layout import INDENT, bracketed, docstring, string
from .names import EMPTY_STRUCT, ModuleNames, exception_member_name, python_name
from .places import GeneratedModule, Places

_BUILTINS = {"bool": "bool", "string": "str", "float": "float", "double": "float"}
_RUNTIME_TYPES = {"byte": "Byte", "short": "Short", "int": "Int", "long": "Long"}


class TypeWriter:
    """Writes the types of one module and knows how a type is written in its annotations."""

    def __init__(self, names: ModuleNames, places: Places, module: GeneratedModule) -> None:
        self._names = names
        self._places = places
        self._module = module
        self.uses_empty_struct = False

    # Types in annotations

    def annotation(self, kind: ast.Type) -> str:
        """Return a type as it is written in an annotation."""
        match kind:
            case ast.BuiltinType(name=name) if name in _BUILTINS:
                return self._names.builtin(_BUILTINS[name])
            case ast.BuiltinType(name=name):
                return self._names.runtime(_RUNTIME_TYPES[name])
            case ast.NamedType(definition=ast.Class() as definition):
                return f"{self.reference(definition)} | None"
            case ast.NamedType(definition=ast.Definition() as definition):
                return self.reference(definition)
        raise AssertionError(f"the checker let pass {kind}")

    def reference(self, definition: ast.Definition, name: str | None = None) -> str:
        """Return how a definition, or another name that goes with it, is written here."""
        name = name or python_name(definition)
        place = self._places.of(definition)
        if place is self._module:
            return self._names.defined(name)
        return self._names.imported(self._names.relative(place.package, place.name), name)

    def in_order_of_use(self) -> Iterator[ast.Definition]:
        """Yield the definitions of the module in an order in which what runs at import finds what it needs.

        That is the order of the source, but for sequences and dictionaries of classes declared beforehand.
        """
        here = {definition.scoped for definition in self._module.definitions}
        done: set[str] = set()
        waiting = list(self._module.definitions)
        while waiting:
            ready = next(each for each in waiting if _needs(each) & here <= done)
            waiting.remove(ready)
            done.add(ready.scoped)
            yield ready

    # Definitions

    def write(self, definition: ast.Definition) -> list[list[str]]:
        """Return the statements of a data type or a constant."""
        match definition:
            case ast.Struct():
                lines = self._record(definition, self._names.runtime("Struct"), definition.members)
            case ast.Class():
                base = definition.base_definition
                parent = self.reference(base) if base else self._names.runtime("Struct")
                lines = self._record(definition, parent, definition.members)
            case ast.ExceptionType():
                lines = self._exception(definition)
            case ast.Enumeration():
                lines = self._enumeration(definition)
            case ast.Sequence(element=ast.BuiltinType(name="byte")):
                lines = self._alias(definition, self._names.builtin("bytes"))
            case ast.Sequence():
                element = self.annotation(definition.element)
                lines = self._alias(definition, f"{self._names.builtin('list')}[{element}]")
            case ast.Dictionary():
                types = f"{self.annotation(definition.key)}, {self.annotation(definition.value)}"
                lines = self._alias(definition, f"{self._names.builtin('dict')}[{types}]")
            case ast.Constant():
                lines = self._constant(definition)
            case _:
                raise AssertionError(f"no Python for {definition}")
        name = python_name(definition)
        if self._names.is_shadowed(name):
            return [lines, [f"{self._names.defined(name)} = {name}"]]
        return [lines]

    def record(
        self, name: str, doc: str, parent: str, fields: Sequence[tuple[str, str, str, str]], option: str = ""
    ) -> list[str]:
        """Return a struct with fields of (name in Python, name on the wire, annotation, doc)."""
        renamed = [f'"{python}": "{wire}"' for python, wire, _, _ in fields if python != wire]
        options = [parent]
        if option:
            options.append(option)
        if renamed:
            options.append(f"rename={{{', '.join(renamed)}}}")
        lines = bracketed(f"class {name}(", options, "):")
        if doc:
            lines += docstring(doc, INDENT)
            lines += [""] if fields else []
        for python, _, annotation, text in fields:
            lines.append(f"{INDENT}{python}: {annotation}")
            if text:
                lines += docstring(text, INDENT)
        if not doc and not fields:
            lines.append(f"{INDENT}pass")
        return lines

    def fields(
        self, members: Iterable[ast.Member | ast.Parameter], *, documented: bool = True
    ) -> list[tuple[str, str, str, str]]:
        """Return members as fields of a struct."""
        return [
            (
                python_name(member),
                member.name,
                self.annotation(member.type),
                parse_doc_comment(member.doc).text if documented else "",
            )
            for member in members
        ]

    def empty_struct(self) -> str:
        """Return the name of the module's struct without members."""
        self.uses_empty_struct = True
        return EMPTY_STRUCT

    def write_empty_struct(self) -> list[str]:
        """Return the struct that stands for no arguments and no results."""
        return self.record(
            EMPTY_STRUCT,
            "The arguments or results of operations without any.",
            self._names.runtime("Struct"),
            (),
        )

    def _record(
        self, definition: ast.Struct | ast.Class, parent: str, members: Sequence[ast.Member]
    ) -> list[str]:
        doc = parse_doc_comment(definition.doc).text
        return self.record(python_name(definition), doc, parent, self.fields(members))

    def _exception(self, definition: ast.ExceptionType) -> list[str]:
        base = definition.base_definition
        parent = self.reference(base) if base else self._names.runtime("UserException")
        name = python_name(definition)
        lines = [f"class {name}({parent}):"]
        doc = parse_doc_comment(definition.doc).text
        if doc:
            lines += [*docstring(doc, INDENT), ""]
        text, class_var = self._names.builtin("str"), self._names.imported("typing", "ClassVar")
        lines.append(f"{INDENT}ice_type_id: {class_var}[{text}] = {string(definition.scoped)}")
        if definition.members:
            struct = f"{parent}.Members" if base else self._names.runtime("Struct")
            fields = [
                (exception_member_name(member), *field[1:])
                for member, field in zip(definition.members, self.fields(definition.members), strict=True)
            ]
            members = self.record("Members", "The members that travel.", struct, fields)
            lines += ["", *(INDENT + line if line else "" for line in members)]
            lines += ["", *self._constructor(definition)]
        return lines

    def _constructor(self, definition: ast.ExceptionType) -> list[str]:
        own = [exception_member_name(member) for member in definition.members]
        every = [exception_member_name(member) for member in definition.all_members]
        inherited = every[: len(every) - len(own)]
        parameters = ["self"]
        for member, name in zip(definition.all_members, every, strict=True):
            parameters.append(f"{name}: {self.annotation(member.type)}")
        body = INDENT * 2
        # The arguments of Exception are those of the whole exception: that is what pickle and repr use.
        arguments = inherited if inherited else every
        return [
            *bracketed("def __init__(", parameters, ") -> None:", INDENT),
            *bracketed(f"{self._names.builtin('super')}().__init__(", arguments, ")", body),
            *([f"{body}self.args = ({', '.join(every)})"] if inherited else []),
            *(f"{body}self.{name} = {name}" for name in own),
        ]

    def _enumeration(self, definition: ast.Enumeration) -> list[str]:
        lines = [f"class {python_name(definition)}({self._names.imported('enum', 'IntEnum')}):"]
        doc = parse_doc_comment(definition.doc).text
        if doc:
            lines += [*docstring(doc, INDENT), ""]
        for enumerator in definition.enumerators:
            lines.append(f"{INDENT}{python_name(enumerator)} = {enumerator.value}")
            text = parse_doc_comment(enumerator.doc).text
            if text:
                lines += docstring(text, INDENT)
        return lines

    def _alias(self, definition: ast.Definition, target: str) -> list[str]:
        doc = parse_doc_comment(definition.doc).text
        return [f"{python_name(definition)} = {target}", *(docstring(doc) if doc else [])]

    def _constant(self, definition: ast.Constant) -> list[str]:
        literal = definition.literal
        final = self._names.imported("typing", "Final")
        if isinstance(literal.target, ast.Enumerator) and literal.target.enumeration is not None:
            enumeration = self.reference(literal.target.enumeration)
            value = f"{enumeration}.{python_name(literal.target)}"
        elif isinstance(literal.value, str):
            value = string(literal.value)
        else:
            value = repr(literal.value).replace("e+", "e")
        doc = parse_doc_comment(definition.doc).text
        annotation = self.annotation(definition.type)
        line = f"{python_name(definition)}: {final}[{annotation}] = {value}"
        return [line, *(docstring(doc) if doc else [])]


def _needs(definition: ast.Definition) -> set[str]:
    """Return the scoped names of what must be defined before a definition when the module is imported."""
    match definition:
        case ast.Sequence():
            needed = [definition.element]
        case ast.Dictionary():
            needed = [definition.key, definition.value]
        case ast.Constant():
            needed = [definition.type]
        case ast.Class() | ast.ExceptionType():
            return {definition.base_definition.scoped} if definition.base_definition else set()
        case ast.Interface():
            bases = {base.scoped for base in definition.base_definitions}
            thrown = [named.definition for operation in definition.operations for named in operation.throws]
            return bases | {exception.scoped for exception in thrown if exception}
        case _:
            return set()
    return {kind.definition.scoped for kind in needed if isinstance(kind, ast.NamedType) and kind.definition}
