"""The rules for names that the generated Python needs for itself."""

from __future__ import annotations

from codegen.diagnostics import Note

from . import ast
from .codes import Code
from .resolver import Resolver


def check_generated_names(
    interface: ast.Interface, inherited: dict[str, ast.Definition], resolver: Resolver
) -> None:
    """Report operations and parameters with a name that proxies, servants or the wire use."""
    own = interface.operations
    for operation in own:
        if operation.name.startswith("ice_"):
            message = f"operation `{operation.name}`: names with `ice_` belong to what every object offers"
            resolver.error(Code.RESERVED_NAME, message, operation.token)
        for parameter in operation.outputs:
            if parameter.name == "returnValue" and operation.returns is not None:
                message = "`returnValue` is how the wire calls what an operation returns"
                resolver.error(Code.RESERVED_NAME, message, parameter.token)
    operations = {each.name: each for each in inherited.values() if isinstance(each, ast.Operation)}
    operations |= {operation.name: operation for operation in own}
    for operation in operations.values():
        for suffix in ("Async", "Publisher") if operation.streamed else ("Async",):
            other = operations.get(operation.name + suffix)
            if other is None or (operation not in own and other not in own):
                continue
            note = Note(f"`{operation.name}` brings `{other.name}` with it", operation.token.location)
            message = f"operation `{other.name}` has the name of a generated method"
            resolver.error(Code.NAME_CLASH_IN_OUTPUT, message, other.token, note)
