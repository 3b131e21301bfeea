"""Write structs: their options, and their members with types, default values and docs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from . import ast
from .annotations import Annotations
from .doc_comments import parse_doc_comment
from .layout import INDENT, bracketed, docstring
from .names import python_name


@dataclass(frozen=True, slots=True)
class Field:
    """A member of a struct."""

    name: str
    """Its name in Python."""
    wire_name: str
    annotation: str
    doc: str = ""
    default: str = ""
    """The expression of its default value; nothing for a required member."""

    @property
    def declaration(self) -> str:
        """The member as it is declared."""
        return f"{self.name}: {self.annotation}" + (f" = {self.default}" if self.default else "")


def fields_of(
    members: Iterable[ast.Member | ast.Parameter], annotations: Annotations, *, documented: bool = True
) -> list[Field]:
    """Return members or parameters as members of a struct."""
    return [
        Field(
            python_name(member),
            member.name,
            annotations.type(member.type, optional=member.tag is not None),
            parse_doc_comment(member.doc).text if documented else "",
            default_of(member, annotations),
        )
        for member in members
    ]


def default_of(member: ast.Member | ast.Parameter, annotations: Annotations) -> str:
    """Return the expression of a default value: what stands in the file, or None for what is optional."""
    if isinstance(member, ast.Member) and member.default is not None:
        return annotations.value(member.default, member.type)
    return "None" if member.tag is not None else ""


def write_record(
    name: str,
    doc: str,
    bases: Sequence[str],
    fields: Sequence[Field],
    *,
    follows_default: bool = False,
) -> list[str]:
    """Return a struct; `bases` are what it extends and its options.

    `follows_default` tells that it extends a struct in which a member has a default value.
    """
    options = list(bases)
    if needs_names(fields, follows_default=follows_default):
        options.append("kw_only=True")
    renamed = [f'"{field.name}": "{field.wire_name}"' for field in fields if field.name != field.wire_name]
    if renamed:
        options.append(f"rename={{{', '.join(renamed)}}}")
    lines = bracketed(f"class {name}(", options, "):")
    if doc:
        lines += docstring(doc, INDENT)
        lines += [""] if fields else []
    for field in fields:
        lines.append(f"{INDENT}{field.declaration}")
        if field.doc:
            lines += docstring(field.doc, INDENT)
    if not doc and not fields:
        lines.append(f"{INDENT}pass")
    return lines


def needs_names(fields: Sequence[Field], *, follows_default: bool = False) -> bool:
    """Return whether members must be given by name, as one without a default value follows one with it."""
    for field in fields:
        if follows_default and not field.default:
            return True
        follows_default = follows_default or bool(field.default)
    return False
