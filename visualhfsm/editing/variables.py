"""Tell which lines of an automaton's variables are whose."""

from __future__ import annotations

import ast
import re
from collections.abc import Set as AbstractSet
from typing import Final, NamedTuple

__all__ = ["split_variables"]

_LINE: Final = re.compile(r"[^\r\n]*(?:\r\n|\r|\n)|[^\r\n]+")  # as Python's parser counts them


def split_variables(text: str, inside: AbstractSet[str], outside: AbstractSet[str]) -> tuple[str, str]:
    """Return the lines of variables that stay, and those that only code with the words `inside` uses.

    A line goes when it gives values to names that are among those words, that are not among the words
    `outside`, and that no other line needs, and when it needs no line that stays. What is no Python stays.
    """
    try:
        statements = ast.parse(text).body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return text, ""
    names = [_names(each) for each in statements]
    going = {
        index
        for index, each in enumerate(names)
        if each.given and each.given <= inside and not each.given & outside and _is_alone(statements, index)
    }
    while True:
        staying = [each for index, each in enumerate(names) if index not in going]
        needed = {name for each in staying for name in each.used | each.given}
        bound = {name for each in staying for name in each.given | each.bound}
        held = {index for index in going if names[index].given & needed or names[index].used & bound}
        if not held:
            break
        going -= held
    lines = _LINE.findall(text)
    gone = {
        line
        for index in going
        for line in range(statements[index].lineno, (statements[index].end_lineno or 0) + 1)
    }
    taken = "".join(line for number, line in enumerate(lines, 1) if number in gone)
    return "".join(line for number, line in enumerate(lines, 1) if number not in gone), taken.rstrip("\r\n")


class _Names(NamedTuple):
    given: set[str]
    """Names to which a plain assignment gives values; none of any other statement."""
    bound: set[str]
    """Names that any other statement binds, such as an import."""
    used: set[str]


def _names(statement: ast.stmt) -> _Names:
    found = [each for each in ast.walk(statement) if isinstance(each, ast.Name)]
    used = {each.id for each in found if isinstance(each.ctx, ast.Load)}
    stored = {each.id for each in found if not isinstance(each.ctx, ast.Load)}
    if isinstance(statement, ast.Assign | ast.AnnAssign):
        targets = statement.targets if isinstance(statement, ast.Assign) else [statement.target]
        if all(
            isinstance(each, ast.Name) for each in targets
        ):  # not several at once, nor members of something
            return _Names(stored, set(), used)
    for each in ast.walk(statement):
        if isinstance(each, ast.alias):
            stored.add((each.asname or each.name).partition(".")[0])
        elif isinstance(each, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            stored.add(each.name)
    return _Names(set(), stored, used)


def _is_alone(statements: list[ast.stmt], index: int) -> bool:
    """Return whether a statement shares its lines with no other."""
    first, last = statements[index].lineno, statements[index].end_lineno or 0
    others = statements[:index] + statements[index + 1 :]
    return not any(each.lineno <= last and (each.end_lineno or 0) >= first for each in others)
