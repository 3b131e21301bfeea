"""Find names of a generated component that would have two meanings.

Its file and its class consist of lines that the generator writes and of people's code. A name that two of
them bind has the meaning of the last, also where the generator relies on the first.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator

from .code.text import bound_names, own_nodes, parse_python
from .source_map import SourceMap


def ambiguous_names(text: str, source_map: SourceMap) -> Iterator[str]:
    """Yield the names in the text of a component that a generated line binds and another line binds, too.

    In its class, they are also those that a generated line reads after a line of the class has bound them:
    it means what the file has imported. Names that only people's code binds twice may be so on purpose.
    """
    tree = parse_python(text)
    scopes: list[ast.Module | ast.ClassDef] = [tree]
    scopes += (node for node in tree.body if isinstance(node, ast.ClassDef))
    for scope in scopes:
        generated: set[str] = set()
        written: set[str] = set()
        for statement in scope.body:
            bound = bound_names(ast.Module([statement], []))
            if source_map.find(statement.lineno) is not None:
                yield from sorted(bound & generated)
                written |= bound
            else:
                used = bound if scope is tree else bound | _read(statement)
                yield from sorted(used & (generated | written))
                generated |= bound


def _read(statement: ast.stmt) -> set[str]:
    """Return the names that a statement reads at once."""
    nodes = own_nodes(ast.Module([statement], []))
    return {node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)}
