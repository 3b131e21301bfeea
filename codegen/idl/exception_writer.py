"""Write an exception: its type id, the members that travel, and its constructor."""

from __future__ import annotations

from dataclasses import replace

from . import ast
from .annotations import Annotations
from .doc_comments import parse_doc_comment
from .layout import INDENT, bracketed, docstring, string
from .names import ModuleNames, exception_member_name, python_name
from .record_writer import Field, fields_of, needs_names, write_record


def write_exception(definition: ast.ExceptionType, annotations: Annotations, names: ModuleNames) -> list[str]:
    """Return the class of an exception."""
    base = definition.base_definition
    parent = annotations.reference(base, at_import=True) if base else names.runtime("UserException")
    lines = [f"class {python_name(definition)}({parent}):"]
    doc = parse_doc_comment(definition.doc).text
    if doc:
        lines += [*docstring(doc, INDENT), ""]
    text, class_var = names.builtin("str"), names.imported("typing", "ClassVar")
    lines.append(f"{INDENT}ice_type_id: {class_var}[{text}] = {string(definition.scoped)}")
    if definition.members:
        every = _fields(definition, annotations)
        own = every[-len(definition.members) :]
        inherited = every[: -len(definition.members)]
        doc, bases = "The members that travel.", [f"{parent}.Members"]
        follows_default = any(field.default for field in _sent(inherited))
        members = write_record("Members", doc, bases, _sent(own), follows_default=follows_default)
        lines += ["", *(INDENT + line if line else "" for line in members)]
        lines += ["", *_constructor(parent, own, inherited, names)]
    return lines


def _fields(definition: ast.ExceptionType, annotations: Annotations) -> list[Field]:
    members = definition.all_members
    return [
        replace(field, name=exception_member_name(member))
        for member, field in zip(members, fields_of(members, annotations), strict=True)
    ]


def _sent(fields: list[Field]) -> list[Field]:
    """Return members as they travel: default values are for constructors."""
    return [field if field.default == "None" else replace(field, default="") for field in fields]


def _constructor(parent: str, own: list[Field], inherited: list[Field], names: ModuleNames) -> list[str]:
    every = [*inherited, *own]
    body = INDENT * 2
    # The arguments of Exception are those of the whole exception: that is what repr shows.
    handed_on = inherited or every
    arguments = [field.name for field in handed_on]
    if inherited and needs_names(inherited):
        arguments = [f"{name}={name}" for name in arguments]
    call = f"{names.builtin('super')}().__init__("
    if call != "super().__init__(":  # a member is called super
        call, arguments = f"{parent}.__init__(", ["self", *arguments]
    return [
        *bracketed("def __init__(", ["self", *_parameters(every)], ") -> None:", INDENT),
        *bracketed(call, arguments, ")", body),
        *([f"{body}self.args = ({', '.join(field.name for field in every)})"] if inherited else []),
        *(f"{body}self.{field.name} = {field.name}" for field in own),
    ]


def _parameters(fields: list[Field]) -> list[str]:
    """Return parameters; from the first that has none behind a default value, they are given by name."""
    parameters = [field.declaration for field in fields]
    if needs_names(fields):
        with_default = [bool(field.default) for field in fields]
        first = with_default.index(False, with_default.index(True))
        parameters.insert(first, "*")
    return parameters
