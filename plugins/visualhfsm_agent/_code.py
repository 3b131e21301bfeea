"""Code that an agent may run: it computes and calls the servants of its document, and reaches nothing else.

Modules of a closed list may be imported, and no name leads out of them: neither to files, programs and other
modules, nor around the proxies of the component, which keep a person's limits. All else is refused.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from importlib.machinery import PathFinder
from pathlib import Path
from typing import Final

from ._limits import AgentError


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


_MODULES: Final = _words("""
    __future__ cmath collections cv2 dataclasses enum functools interfaces itertools json math numpy random re
    statistics time typing
""")
_OF_RUNTIME: Final = _words("""
    Automaton Component Event Input Output Parameter Proxy State Transition load_extension main source_map
""")
_NAMES: Final = _words("""
    __builtins__ breakpoint compile delattr eval exec exit getattr globals help input locals open quit setattr
    type vars
""")
_ALSO_METHODS: Final = _words("array cmd code copy queue select signal site this token trace")
"""Names of modules that are those of methods, too; what they lead to has other names."""
_METHODS: Final = _words("__call__ __init__ __iter__ __len__ __next__ __post_init__ __repr__ __str__")
"""Special methods that may be defined; others would see frames, or pretend to be values of other kinds."""
_FILES: Final = _words("""
    DataSource FileStorage HOGDescriptor NpzFile VideoCapture VideoWriter as_strided
    ctypeslib dnn dump dumps exec_file_wrapper f2py fromfile fromregex fromtextfile gapi genfromtxt load
    memmap mrec mrecords open_memmap openfile readOpticalFlow samples testing tofile tool writeOpticalFlow
""")
"""What numpy, cv2 and json read and write files and memory by, and load code."""
_PREFIXES: Final = (
    *("_", "ice_", "gi_", "cr_", "ag_", "tb_", "f_"),  # what is private, of proxies, and of frames
    *(
        "imread",
        "imwrite",
        "load_",
        "loadt",
        "loadC",
        "loadM",
        "loadP",
        "save",
        "dnn_",
        "CascadeC",
    ),  # files, by numpy and cv2
)
_AROUND: Final = _words("""
    ABCMeta EnumDict EnumMeta EnumType ForwardRef Formatter begin_encoded bltns call_encoded
    checkedCast communicator
    createObjectAdapter eval evaluate_forward_ref exec format format_map generated get_type_hints getattr
    initialize main
    make_dataclass open setattr singledispatch singledispatchmethod source_map stringToProxy type
    uncheckedCast update_wrapper wraps zenoh zenoh_ice
""")
"""What leads around the proxies, and to attributes and code by their text."""
_ATTRIBUTES: Final = _FILES | _AROUND | (sys.stdlib_module_names - _MODULES - _ALSO_METHODS)
_OF_GENERATED: Final = _words("Proxy __file__ __name__ __package__ load_extension main source_map")
"""Names that stand in generated code alone, as it uses them."""


def require_tame(folder: Path) -> None:
    """Raise AgentError, with file and line, unless all code in a folder with a component is tame."""
    files = sorted(folder.rglob("*.py"))
    beside = {each.stem for each in files}
    for file in files:
        if _is_installed(file.stem):
            raise AgentError.because("{file} has the name of an installed module", file=file.name)
        try:
            tree = ast.parse(file.read_bytes())
        except (SyntaxError, ValueError, RecursionError) as error:
            raise AgentError.because("{file} cannot be read as Python", file=file.name) from error
        for line, what in _wild(tree, beside):
            raise AgentError.because(
                "{file}, line {line}: an agent's code may not use {what}",
                file=file.name,
                line=line,
                what=what,
            )


def identities_of(component: Path) -> frozenset[str]:
    """Return the identities of the servants that a generated component declares."""
    calls = (node for node in ast.walk(ast.parse(component.read_bytes())) if isinstance(node, ast.Call))
    return frozenset(
        str(call.args[0].value)
        for call in calls
        if isinstance(call.func, ast.Name)
        and call.func.id == "Proxy"
        and isinstance(call.args[0], ast.Constant)
    )


def _wild(tree: ast.Module, beside: set[str]) -> Iterator[tuple[int, str]]:
    """Yield the lines of what is not tame, and its names."""
    known = {id(each) for node in ast.walk(tree) for each in _harmless(node)}
    for node in ast.walk(tree):
        found: list[str] = []
        match node:
            case ast.Import(names=names):
                found = [each.name for each in names if not _may_import(each.name, beside)]
            case ast.ImportFrom(module="hfsm_runtime", names=names, level=0):
                found = [each.name for each in names if each.name not in _OF_RUNTIME or each.asname]
            case ast.ImportFrom(module=module, names=names, level=level):
                found = [
                    each.name
                    for each in names
                    if each.name in _OF_GENERATED or (_leads_out(each.name) and not _is_proxy(each))
                ]
                if level or not _may_import(module or "", beside):
                    found.append(module or ".")
            case ast.Name(id=name) if id(node) not in known:
                if name in _NAMES | _OF_GENERATED or name.endswith("Prx") or name.startswith("__"):
                    found = [name]
            case ast.Attribute(attr=name, ctx=context) if _leads_out(name) or isinstance(context, ast.Del):
                found = [name]
            case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name) if name in _METHODS:
                pass
            case ast.MatchClass(kwd_attrs=names):
                found = [each for each in names if _leads_out(each)]
            case ast.Constant() | ast.Name() | ast.Attribute() | ast.keyword():
                pass
            case _:  # what binds a name otherwise
                given = {getattr(node, each, None) for each in ("asname", "arg", "rest")}
                if not isinstance(node, ast.alias):
                    given.add(getattr(node, "name", None))
                found = [str(each) for each in given if each in _OF_GENERATED or str(each).startswith("__")]
        yield from ((getattr(node, "lineno", 0), name) for name in found)


def _harmless(node: ast.AST) -> Iterator[ast.AST]:
    """Yield names that may be used in this way, as generated code does, and no other."""
    match node:
        case ast.Call(
            func=ast.Name(id="load_extension") as called,
            args=[ast.Name(id="__file__") as file, ast.Name(id="__package__") as package, *rest],
            keywords=[],
        ) if all(isinstance(each, ast.Constant) and str(each.value).isidentifier() for each in rest):
            yield from (called, file, package)
        case ast.Call(func=ast.Name(id="source_map") as called, args=[ast.Name(id="__file__") as file, _]):
            yield from (called, file)
        case ast.Call(func=ast.Name(id="Proxy") as called, args=[ast.Constant(), ast.Name() as kind]):
            yield from (called, kind)
        case ast.If(
            test=ast.Compare(left=ast.Name(id="__name__") as name, comparators=[ast.Constant("__main__")]),
            body=[ast.Expr(ast.Call(func=ast.Name(id="main") as called, args=[ast.Name()]))],
        ) if isinstance(node.test.ops[0], ast.Eq):  # type: ignore[attr-defined]
            yield from (name, called)
        case ast.Call(
            func=ast.Name(id="getattr") as called,
            args=[ast.Name(id="self"), ast.JoinedStr(values=[*_, ast.Constant(value=str() as end)]), *_],
        ) if end.endswith(("Motors", "Encoders")):  # what is not a user's ends otherwise
            yield called
        case ast.Call(
            func=ast.Name(id="getattr" | "setattr") as called,
            args=[_, ast.Constant(value=str() as attribute), *_],
        ) if not _leads_out(attribute):
            yield called


def _may_import(module: str, beside: set[str]) -> bool:
    """Return whether a module may be imported: one of the list, or code beside the component."""
    first, *inner = module.split(".")
    return first in _MODULES | beside and not any(map(_leads_out, inner))


def _is_installed(module: str) -> bool:
    """Return whether a name is that of another module than one beside the component."""
    places = [each for each in sys.path if each and Path(each).resolve() != Path.cwd()]
    found = PathFinder.find_spec(module, places)
    known = module in sys.stdlib_module_names | _MODULES or hasattr(sys.modules.get(module), "__path__")
    return known or bool(found and found.origin)


def _is_proxy(name: ast.alias) -> bool:
    return name.name.endswith("Prx") and (name.asname or name.name).endswith("Prx")


def _leads_out(name: str) -> bool:
    return name in _ATTRIBUTES or name.startswith(_PREFIXES) or name.endswith("Prx") or name == "*"
