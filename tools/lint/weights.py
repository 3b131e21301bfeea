"""What a head must hold is counted in weights.toml: code by rooms, and the kinds of things that one meets.

A line of code is one that is not blank, and no comment, docstring or import. A count above its limit is a
mistake, and so is one far below: what was taken away stays away. `python -m tools.lint.weights` prints all
counts, rounded up, as that file has them.
"""

from __future__ import annotations

import ast
import io
import re
import tokenize
import tomllib
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final

from tools.lint.layout import GENERATED
from tools.lint.sources import ROOT
from tools.workspace import CORE, DISTRIBUTIONS, Distribution

LIMITS: Final = "weights.toml"
SLACK: Final = 0.03
"""A limit may be this fraction above its count, and `SPARE` more."""
SPARE: Final = {"python": 30, "javascript": 30, "concepts": 0}
PAGE: Final = ROOT / "visualhfsm/_editor/static"
OTHERS: Final = {"vendor", "pictures"}
"""Folders of the page that are not ours, or no code."""
NO_CODE: Final = {
    *(tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT),
    *(tokenize.ENCODING, tokenize.ENDMARKER),
}
SEAM: Final = re.compile(r"(?:naoserver|visualhfsm|codegen)\.(?:entrances|commands|views|formats|kinds)")
"""A group of entry points that the core asks for."""
PROCESSES: Final = {"subprocess", "multiprocessing"}
"""A module that imports one of these starts child processes."""


def mistakes() -> Iterator[str]:
    """Yield the counts that are above their limits, or far below."""
    limits = tomllib.loads((ROOT / LIMITS).read_text("utf-8"))
    # A checkout may lack the folder of a plug-in.
    limits["python"] = {name: limit for name, limit in limits["python"].items() if (ROOT / name).exists()}
    for kind, counts in weights().items():
        yield from compared(kind, limits.get(kind, {}), counts)


def compared(kind: str, limits: Mapping[str, int], counts: Mapping[str, int]) -> Iterator[str]:
    """Yield the counts of a kind that are above their limits, or far below."""
    for name in sorted(limits.keys() | counts):
        limit, count = limits.get(name, 0), counts.get(name, 0)
        if count > limit:
            why = "take something away, or raise the limit and say in the commit why"
        elif limit > count * (1.0 + SLACK) + SPARE[kind]:
            why = "lower the limit"
        else:
            continue
        yield f"{LIMITS}: {kind}: {name}: {count}, limit {limit}: {why}"


def weights() -> dict[str, dict[str, int]]:
    """Return all counts by kind and name."""
    return {
        "python": _python(),
        "javascript": {
            room.name: sum(lines_of_script(path.read_text("utf-8")) for path in room.rglob("*.js"))
            for room in PAGE.iterdir()
            if room.is_dir() and room.name not in OTHERS and any(room.rglob("*.js"))
        },
        "concepts": _concepts(),
    }


def lines_of_code(text: str) -> int:
    """Return the lines of code of a module of Python."""
    no_code = {line for node in ast.walk(ast.parse(text)) for line in _set_aside(node)}
    lines = {
        line
        for token in tokenize.generate_tokens(io.StringIO(text).readline)
        if token.type not in NO_CODE
        for line in range(token.start[0], token.end[0] + 1)
    }
    return len(lines - no_code)


def lines_of_script(text: str) -> int:
    """Return the lines of code of a module of the page."""
    text = re.sub(r"^\s*/\*.*?\*/", "", text, flags=re.DOTALL | re.MULTILINE)
    text = re.sub(r"^import\b[^;]*;", "", text, flags=re.MULTILINE)
    return sum(bool(line.strip()) and not line.strip().startswith("//") for line in text.splitlines())


def _set_aside(node: ast.AST) -> range:
    """Return the lines of an import, or of a text that stands by itself, which documents what is above it."""
    match node:
        case ast.Import() | ast.ImportFrom() | ast.Expr(value=ast.Constant(value=str())):
            return range(node.lineno, (node.end_lineno or node.lineno) + 1)
        case _:
            return range(0)


def _python() -> dict[str, int]:
    counts: Counter[str] = Counter()
    for path in _modules(*DISTRIBUTIONS):
        counts[_room(path)] += lines_of_code(path.read_text("utf-8"))
    return dict(counts)


def _room(path: Path) -> str:
    """Return the folder whose lines are counted together: of a plug-in, its house."""
    return "/".join(path.relative_to(ROOT).parts[:-1][:2])


def _modules(*distributions: Distribution) -> list[Path]:
    """Return the modules of wheels that are written by hand."""
    written = [path for each in distributions for path in each.packages if path.name not in GENERATED]
    return sorted(path for package in written for path in package.rglob("*.py"))


def _concepts() -> dict[str, int]:
    trees = [ast.parse(path.read_text("utf-8")) for path in _modules(CORE)]
    nodes = [node for tree in trees for node in ast.walk(tree)]
    classes = [node for node in nodes if isinstance(node, ast.ClassDef)]
    calls = [node.func for node in nodes if isinstance(node, ast.Call)]
    imported = [_imported(tree) for tree in trees]
    codes = re.compile(r"[EWN]\d{3}")
    return {
        "codes of diagnostics": len(
            {
                node.value
                for node in nodes
                if isinstance(node, ast.Constant)
                and isinstance(node.value, str)
                and codes.fullmatch(node.value)
            }
        ),
        "commands of documents": len(_descendants("Command", classes)),
        "modules that read Python": sum("ast" in names for names in imported),
        "modules that start processes": sum(bool(names & PROCESSES) for names in imported),
        "options of commands": sum(
            isinstance(call, ast.Attribute) and call.attr == "Option" for call in calls
        ),
        "protocols": sum("Protocol" in _bases(each) for each in classes),
        "requests of the page": sum(isinstance(call, ast.Name) and call.id == "_on" for call in calls),
        "seams": len(
            {
                node.value
                for node in nodes
                if isinstance(node, ast.Constant)
                and isinstance(node.value, str)
                and SEAM.fullmatch(node.value)
            }
        ),
    }


def _imported(tree: ast.Module) -> set[str]:
    """Return the modules that a module imports, by the first part of their names."""
    found = {
        alias.name.partition(".")[0]
        for node in ast.walk(tree)
        if isinstance(node, ast.Import)
        for alias in node.names
    }
    return found | {
        (node.module or "").partition(".")[0]
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and not node.level
    }


def _bases(node: ast.ClassDef) -> set[str]:
    """Return the names of the bases of a class, which may be generic."""
    bases = [base.value if isinstance(base, ast.Subscript) else base for base in node.bases]
    return {base.id for base in bases if isinstance(base, ast.Name)}


def _descendants(name: str, classes: Sequence[ast.ClassDef]) -> set[str]:
    """Return the names of the classes that derive from one, some by way of others."""
    found = {each.name for each in classes if name in _bases(each)}
    return found.union(*(_descendants(each, classes) for each in found))


if __name__ == "__main__":
    print("# What a head must hold, as tools/lint/weights.py counts it. Who raises a number says why.")
    for kind, counts in weights().items():
        print(f"\n[{kind}]")
        for name, count in sorted(counts.items()):
            step = 10 if SPARE[kind] else 1
            print(f'"{name}" = {-(-count // step) * step}')
