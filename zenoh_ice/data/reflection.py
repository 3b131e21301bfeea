"""Describe generated types and interfaces at run time: members, operations, docs and fingerprints.

    >>> from zenoh_ice.data.reflection import describe_package
    >>> [operation.name for operation in describe_package("interfaces.nao")["::nao::PoseHead"].operations]
    ['setPose', 'setSpeed', 'stop', 'getPose', 'getLimits']

Names and types are those of Slice, from the root: `::nao::HeadPose`, `sequence` types by their name.

codegen writes the descriptions into the `schema.json` of each generated package; they are read on first use.
A servant sends those of its interface as the answer to `ice_describe`.
"""

from __future__ import annotations

import keyword
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator
from functools import lru_cache
from typing import Annotated, Final, Literal

import msgspec
from msgspec import Meta

from zenoh_ice.data import typed
from zenoh_ice.data.codec import DECODE_ERRORS, misfit
from zenoh_ice.data.exceptions import ConfigurationException, MarshalException, ZenohIceError
from zenoh_ice.data.interface import OBJECT_TYPE_ID, RETURN_VALUE, Interface
from zenoh_ice.data.text import printable

_SCHEMA_FILE: Final = "schema.json"
_MALFORMED: Final = "malformed schema of an interface"
_BUILTIN_TYPES: Final = frozenset(
    {"bool", "byte", "short", "int", "long", "float", "double", "string", "Object", "Value"}
)
_TYPE_KINDS: Final = frozenset({"interface", "struct", "class", "enumeration", "sequence", "dictionary"})
_LARGEST_SCHEMA: Final = 1 << 18  # characters that are read; the largest of ours has 20,000
_DEEPEST_TYPE: Final = 32  # types within types, both of a dictionary, or types that extend each other

# As in Slice a name neither begins nor ends with an underscore nor has two together: `__init__` and the like
# cannot be members.
_SIMPLE: Final = "[A-Za-z](?:_?[A-Za-z0-9])*"
_SCOPED: Final = f"(?:::{_SIMPLE})+"
_Name = Annotated[str, Meta(pattern=rf"\A{_SIMPLE}\Z", max_length=256)]
_TypeId = Annotated[str, Meta(pattern=rf"\A{_SCOPED}\Z", max_length=256)]
_TypeName = Annotated[
    str, Meta(pattern=rf"\A(?:[A-Za-z]+|(?:Object|Value|{_SCOPED})\*|{_SCOPED})\Z", max_length=256)
]


class Member(msgspec.Struct, frozen=True, omit_defaults=True):
    """A member of a struct, a class or an exception, a parameter, or a result."""

    name: _Name
    type: _TypeName
    doc: str = ""
    optional: bool = False
    default: bool | int | float | str | None = None
    """The default value, an enumerator by its name; None where there is none."""


class Enumerator(msgspec.Struct, frozen=True, omit_defaults=True):
    """A value of an enumeration."""

    name: _Name
    value: Annotated[int, Meta(ge=0, le=(1 << 31) - 1)]
    doc: str = ""


class OperationDescription(msgspec.Struct, frozen=True, omit_defaults=True):
    """An operation of an interface."""

    name: _Name
    doc: str = ""
    parameters: tuple[Member, ...] = ()
    results: tuple[Member, ...] = ()
    """Its result, by the name `returnValue`, and its out parameters."""
    exceptions: dict[_TypeId, str] = {}
    """Type ids of the exceptions that it throws, each with its doc."""
    idempotent: bool = False
    streamed: bool = False


class Definition(msgspec.Struct, frozen=True, omit_defaults=True):
    """A definition of a Slice file; fields of other kinds are empty."""

    kind: Literal[
        "interface", "struct", "class", "exception", "enumeration", "sequence", "dictionary", "constant"
    ]
    module: str
    """The Python module in the package."""
    name: str
    """The name in Python."""
    fingerprint: str
    """The beginning of the digest of its canonical form, which changes only with the data on the wire."""
    doc: str = ""
    bases: tuple[_TypeId, ...] = ()
    members: tuple[Member, ...] = ()
    """Its own members, without those of its bases."""
    operations: tuple[OperationDescription, ...] = ()
    enumerators: tuple[Enumerator, ...] = ()
    element: _TypeName = ""
    key: _TypeName = ""
    value: _TypeName = ""
    type: _TypeName = ""
    constant: bool | int | float | str | None = None


class Schema(msgspec.Struct, frozen=True):
    """An interface, its bases, and every type that they use."""

    interface: _TypeId
    definitions: dict[_TypeId, Definition]
    """All of them, by type id."""

    def lineage(self, type_id: str) -> list[str]:
        """Return the type ids of a definition and of all that it extends, itself first, each once."""
        found = [type_id]
        for each in found:  # grows during the loop
            found += [base for base in self.definitions[each].bases if base not in found]
        return found

    def part(self, interface: str) -> Schema:
        """Return the part of this schema for another interface in it."""
        return _closure(interface, self.definitions.__getitem__)

    def members(self, type_id: str) -> list[Member]:
        """Return the members of a struct, a class or an exception, those of its bases first."""
        return [
            member for each in reversed(self.lineage(type_id)) for member in self.definitions[each].members
        ]

    def operations(self) -> Iterator[tuple[str, OperationDescription]]:
        """Yield the operations of the interface and of its bases, each with its interface."""
        for type_id in self.lineage(self.interface):
            for operation in self.definitions[type_id].operations:
                yield type_id, operation

    def as_json(self) -> str:
        """Return the schema as JSON, which `parse_schema` reads."""
        return msgspec.json.encode(self).decode()

    def kind(self, type_name: str) -> str:
        """Return the kind of a type by its name; an empty text for builtin types and proxies."""
        definition = self.definitions.get(type_name)
        return definition.kind if definition else ""

    def type_text(self, type_name: str, *, optional: bool = False, scoped: bool = True) -> str:
        """Return a type as text, with sequences and dictionaries spelled out: `sequence<double>`."""
        text = type_name if scoped else unscoped(type_name)
        definition = self.definitions.get(type_name)
        if definition is not None and (inner := _inner_types(definition)):
            parts = ", ".join(self.type_text(each, scoped=scoped) for each in inner)
            text = f"{definition.kind}<{parts}>"
        return f"optional {text}" if optional else text


@lru_cache(maxsize=64)
def describe_package(package: str) -> dict[str, Definition]:
    """Return all definitions of a generated package, by type id: `describe_package("interfaces.nao")`.

    Raises ConfigurationException when codegen did not make the package.
    """
    from importlib import resources  # loads slowly, and few need it

    try:
        data = (resources.files(package) / _SCHEMA_FILE).read_bytes()
        definitions = typed.from_json(data, dict[str, msgspec.Raw])["definitions"]
        return typed.from_json(definitions, dict[_TypeId, Definition])
    except (OSError, ImportError, TypeError, ValueError, KeyError) as error:
        where = package or "code outside a package"
        message = f"{where} has no readable {_SCHEMA_FILE}: generate it with codegen ({error})"
        raise ConfigurationException(message) from error


def schema_of(interface: Interface) -> Schema:
    """Return the schema of an interface that codegen made.

    Raises ConfigurationException when a package that it needs has none.
    """
    if interface.type_id == OBJECT_TYPE_ID:
        plain = Definition(kind="interface", module="", name="Object", fingerprint="")
        return Schema(OBJECT_TYPE_ID, {OBJECT_TYPE_ID: plain})
    package = interface.module.rpartition(".")[0]
    slice_module = interface.type_id.rpartition("::")[0]
    root = package.rsplit(".", slice_module.count("::"))[0]

    def find(type_id: str) -> Definition:
        # The package of another Slice module is next to that of the interface.
        module = type_id.rpartition("::")[0]
        parts = (f"_{part}" if keyword.iskeyword(part) else part for part in module.split("::")[1:])
        known = describe_package(package if module == slice_module else ".".join((root, *parts)))
        if type_id not in known:
            raise ConfigurationException(f"no {_SCHEMA_FILE} describes {type_id}: run codegen again")
        return known[type_id]

    return _closure(interface.type_id, find)


def _closure(interface: str, find: Callable[[str], Definition]) -> Schema:
    """Return the schema of an interface with all that it extends and uses."""
    definitions: dict[str, Definition] = {}
    waiting = [interface]
    while waiting:
        type_id = waiting.pop()
        if type_id not in definitions:
            definitions[type_id] = definition = find(type_id)
            waiting += [*definition.bases, *_used_types(definition), *_exceptions(definition)]
    return Schema(interface, definitions)


def unscoped(type_id: str) -> str:
    """Return the last part of a scoped name: `HeadPose` of `::nao::HeadPose`."""
    return type_id.rpartition("::")[2]


def _inner_types(definition: Definition) -> tuple[str, ...]:
    """Return the types of the elements of a sequence or a dictionary; empty for other kinds."""
    inner = {"sequence": (definition.element,), "dictionary": (definition.key, definition.value)}
    return inner.get(definition.kind, ())


def _used_types(definition: Definition) -> list[str]:
    """Return the names of the defined types that a definition contains, except proxies."""
    members = [*definition.members]
    for operation in definition.operations:
        members += (*operation.parameters, *operation.results)
    used = (*(member.type for member in members), *_inner_types(definition))
    return [each for each in used if each not in _BUILTIN_TYPES and not each.endswith("*")]


def _exceptions(definition: Definition) -> list[str]:
    return [thrown for operation in definition.operations for thrown in operation.exceptions]


def parse_schema(text: str) -> Schema:
    """Return the schema that another process sent, after all checks.

    Raises MarshalException, with the offending name or path, for a text that is too large or no schema, and
    for a schema that refers to definitions it does not have, or has types that contain themselves.
    """
    if len(text) > _LARGEST_SCHEMA:
        raise _malformed(f"it has {len(text)} characters; at most {_LARGEST_SCHEMA} are accepted")
    try:
        schema = typed.from_json(text, Schema)
    except DECODE_ERRORS as error:
        raise misfit(error, _MALFORMED) from error
    _check_references(schema)
    weights: dict[str, int] = {}
    for type_id in schema.definitions:
        _weigh(schema, type_id, weights)
    for type_id, definition in schema.definitions.items():
        _check_unique(type_id, definition.enumerators)
        if definition.kind != "interface":
            _check_unique(type_id, schema.members(type_id))
        for operation in definition.operations:
            _check_unique(f"{type_id}::{operation.name}", operation.parameters)
            _check_unique(f"{type_id}::{operation.name}", operation.results)
    _check_unique(schema.interface, [operation for _, operation in schema.operations()])
    return schema


def _check_references(schema: Schema) -> None:
    """Raise MarshalException when a schema refers to definitions that it does not have."""
    named: list[tuple[str, Collection[str], str]] = [(schema.interface, {"interface"}, "its interface")]
    for type_id, definition in schema.definitions.items():
        if len(definition.bases) > 1 and definition.kind != "interface":
            raise _malformed("only an interface can extend several", type_id)
        named += [(base, {definition.kind}, f"what {type_id!r} extends") for base in definition.bases]
        named += [(used, _TYPE_KINDS, "a type") for used in _used_types(definition)]
        named += [(thrown, {"exception"}, "an exception") for thrown in _exceptions(definition)]
    for name, kinds, meaning in named:
        if schema.kind(name) not in kinds:
            raise _malformed(f"it does not describe {meaning}", name)


def _weigh(schema: Schema, name: str, weights: dict[str, int], around: int = 0) -> int:
    """Return the depth of nested types in a type, where those of a dictionary add up; bounds its name's size.

    Raises MarshalException when it is too deep.
    """
    definition = schema.definitions.get(name)
    if definition is None or definition.kind == "interface":
        return 1
    if name not in weights and around <= _DEEPEST_TYPE:
        by_value = definition.kind in {"struct", "sequence", "dictionary"}  # a class may be null
        within = (*definition.bases, *(_used_types(definition) if by_value else ()))
        each = [_weigh(schema, inner, weights, around + 1) for inner in within]
        weights[name] = 1 + (sum(each) if definition.kind == "dictionary" else max(each, default=0))
    if weights.get(name, _DEEPEST_TYPE + 1) > _DEEPEST_TYPE:
        raise _malformed(f"a type holds or extends itself, or lies more than {_DEEPEST_TYPE} deep", name)
    return weights[name]


def _check_unique(where: str, named: Iterable[Member | Enumerator | OperationDescription]) -> None:
    for name, count in Counter(each.name for each in named).items():
        if count > 1:
            raise _malformed(f"{where!r} has a name twice", name)


def _malformed(problem: str, name: str | None = None) -> MarshalException:
    return MarshalException(f"{_MALFORMED}: {problem}" + ("" if name is None else f": {name!r}"))


def describe_difference(found: Schema, wanted: Interface) -> str:
    """Return how an interface differs from the one that a servant describes."""
    if wanted.type_id not in found.lineage(found.interface):
        return printable(f"the servant has no {wanted.type_id}")
    try:
        expected = schema_of(wanted)
    except ZenohIceError as error:
        return f"the difference is not known ({error})"
    return printable(first_difference(expected, found.part(wanted.type_id)), 1024)


def first_difference(expected: Schema, found: Schema) -> str:
    """Return the first member in which two schemas differ, as the two sides have it."""
    ours, theirs = canonical_lines(expected), canonical_lines(found)
    for subject in sorted({*ours, *theirs}):
        own, other = ours.get(subject), theirs.get(subject)
        if own is None:
            return f"the proxy lacks `{other}`"
        if other is None:
            return f"the servant lacks `{own}`"
        if own != other:
            return f"the proxy has `{own}` where the servant has `{other}`"
    return "they are described alike"


def canonical_lines(schema: Schema) -> dict[str, str]:
    """Return the lines that codegen hashes for the fingerprint, by their subjects: `::nao::Pose::x`."""
    rests: dict[str, str] = {}
    for type_id, definition in schema.definitions.items():
        if definition.kind in {"sequence", "dictionary", "constant"}:
            continue  # definitions that use them write them out
        kind = "enum" if definition.kind == "enumeration" else definition.kind
        bases = ", ".join(sorted(definition.bases))
        rests[f"{kind} {type_id}"] = f" extends {bases}" if bases else ""
        for member in definition.members:
            rests[f"{type_id}::{member.name}"] = f": {_type(schema, member)}"
        for enumerator in definition.enumerators:
            rests[f"{type_id}::{enumerator.name}"] = f" = {enumerator.value}"
        for operation in definition.operations:
            rests[f"{type_id}::{operation.name}"] = _signature(schema, operation)
    return {subject: subject + rest for subject, rest in rests.items()}


def _signature(schema: Schema, operation: OperationDescription) -> str:
    parameters = ", ".join(f"{_type(schema, each)} {each.name}" for each in operation.parameters)
    results = [
        _type(schema, each) + ("" if each.name == RETURN_VALUE else f" {each.name}")
        for each in operation.results
    ]
    text = f"({parameters}): {', '.join(results) or 'void'}"
    if operation.exceptions:
        text += f" throws {', '.join(sorted(operation.exceptions))}"
    return text + " idempotent" * operation.idempotent + " stream" * operation.streamed


def _type(schema: Schema, member: Member) -> str:
    return schema.type_text(member.type, optional=member.optional)
