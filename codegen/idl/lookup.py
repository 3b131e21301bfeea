"""Find what a name given on the command line means: a type, an interface, or an operation."""

from __future__ import annotations

from collections.abc import Mapping

from codegen.diagnostics import did_you_mean

from . import ast

__all__ = ["UnknownNameError", "find_definition"]


class UnknownNameError(Exception):
    """No definition has the name, or several have."""


def find_definition(name: str, definitions: Mapping[str, ast.Definition]) -> ast.Definition:
    """Return a definition or an operation by its scoped name or the end of it: `nao::HeadPose`, `HeadPose`.

    An operation, own or inherited, is named with its interface: `PoseHead::getPose`. Dots stand for colons.
    Raises UnknownNameError.
    """
    wanted = "::" + name.replace(".", "::").removeprefix("::")
    found = _matches(wanted, definitions)
    if not found:
        owner, _, member = wanted.rpartition("::")
        interfaces = [each for each in _matches(owner, definitions) if isinstance(each, ast.Interface)]
        found = [each for interface in interfaces for each in _operations(interface) if each.name == member]
    if len(found) == 1:
        return found[0]
    if found:
        names = ", ".join(each.scoped for each in found)
        raise UnknownNameError(f"`{name}` may be {names}: write more of the name")
    known = [scoped.removeprefix("::") for scoped in definitions]
    notes = did_you_mean(name, [*known, *(each.rpartition("::")[2] for each in known)])
    hint = f": {notes[0].message}" if notes else ""
    raise UnknownNameError(f"no file defines `{name}`{hint}")


def _matches(wanted: str, definitions: Mapping[str, ast.Definition]) -> list[ast.Definition]:
    exact = definitions.get(wanted)
    if exact is not None:
        return [exact]
    return [definition for scoped, definition in definitions.items() if scoped.endswith(wanted)]


def _operations(interface: ast.Interface) -> list[ast.Operation]:
    found = {each.name: each for base in interface.ancestors() for each in base.operations}
    return list({**found, **{each.name: each for each in interface.operations}}.values())
