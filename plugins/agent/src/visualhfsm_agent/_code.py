"""Code that an agent may run: it computes and calls the servants of its document, and reaches nothing else.

A module stands there only as `module.name`, with names of a closed list, so that none leads to another one,
to files or programs. Values have no private attributes, none that leads around the proxies, and of arrays
those of a closed list. All else is refused.
"""

from __future__ import annotations

import ast
import cmath
import itertools
import math
import re
import sys
from collections.abc import Iterator, Mapping
from importlib.machinery import PathFinder
from pathlib import Path
from types import ModuleType
from typing import Final

import numpy as np

from ._limits import AgentError


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


def _public(of: ModuleType | type) -> frozenset[str]:
    return frozenset(name for name in dir(of) if not name.startswith("_"))


_MODULES: Final[Mapping[str, frozenset[str]]] = {
    "__future__": _words("annotations"),
    "cmath": _public(cmath),
    "collections": _words("Counter OrderedDict defaultdict deque"),
    "dataclasses": _words("asdict astuple dataclass field replace"),
    "enum": _words("Enum Flag IntEnum IntFlag auto"),
    "functools": _words("cache cached_property lru_cache partial reduce"),
    "itertools": _public(itertools),
    "json": _words("JSONDecodeError dumps loads"),
    "math": _public(math),
    "random": _words("choice choices expovariate gauss randint random randrange sample seed shuffle uniform"),
    "re": _words("I IGNORECASE escape findall finditer fullmatch match search split sub"),
    "statistics": _words("fmean mean median mode pstdev stdev variance"),
    "time": _words("monotonic perf_counter sleep strftime time"),
    "typing": _words("Any Callable ClassVar Final Iterable Literal NamedTuple Optional Sequence Union"),
    "numpy": _words("""
        abs all allclose any arange arccos arcsin arctan arctan2 argmax argmin argsort argwhere array
        asarray average ceil clip column_stack concatenate cos cross cumsum deg2rad degrees diff dot dtype e
        empty exp eye float32 float64 floor frombuffer full hstack hypot inf int16 int32 int64 int8 interp
        isfinite isnan linalg.det linalg.eig linalg.inv linalg.lstsq linalg.norm linalg.solve linspace log
        maximum mean median meshgrid min minimum max nan nonzero ones ones_like outer percentile pi polyfit
        polyval rad2deg radians random.choice random.normal random.rand random.random random.uniform ravel
        reshape roll round sign sin sort sqrt square stack std sum tan transpose uint16 uint32 uint8 unique
        unwrap var vstack where zeros zeros_like
    """),
    "cv2": _words("""
        Canny GaussianBlur HoughCircles HoughLines HoughLinesP LUT absdiff adaptiveThreshold addWeighted
        approxPolyDP arcLength arrowedLine bilateralFilter bitwise_and bitwise_not bitwise_or bitwise_xor
        blur boundingRect calcHist circle connectedComponents connectedComponentsWithStats contourArea
        convexHull countNonZero cvtColor dilate distanceTransform drawContours ellipse equalizeHist erode
        fillPoly filter2D findContours findNonZero fitEllipse fitLine flip getPerspectiveTransform
        getRotationMatrix2D getStructuringElement goodFeaturesToTrack inRange isContourConvex line
        matchShapes matchTemplate medianBlur merge minAreaRect minEnclosingCircle minMaxLoc moments
        morphologyEx normalize pointPolygonTest pyrDown pyrUp rectangle remap resize rotate split threshold
        transpose undistort warpAffine warpPerspective
    """),
}
"""The names that code may use of each module; of interfaces all types, and proxies as generated code does."""
_CONSTANTS: Final = re.compile(
    "(ADAPTIVE|CC|CHAIN|COLOR|CONTOURS|DIST|FILLED|HOUGH|INTER|LINE|MORPH|NORM|RETR|ROTATE"
    "|THRESH|TM|BORDER)[A-Z0-9a-z_]*"
)
"""The constants of cv2 that code may use."""
_OF_RUNTIME: Final = _words("""
    Automaton Component Event Input Output Parameter Proxy State Transition load_extension main
""")
_NAMES: Final = _words("""
    breakpoint compile delattr eval exec exit getattr globals help input locals memoryview open quit setattr
    type vars
""")
_ATTRIBUTES: Final = re.compile(
    "(_|ice_|gi_|cr_|ag_|tb_|f_).*|.*Prx|begin_encoded|call_encoded|checkedCast"
    "|communicator|createObjectAdapter|ctypes|dump|dumps|format|format_map|globalNamespace|rosNode|setflags"
    "|stringToProxy|tofile|type|uncheckedCast"
)
"""Attributes of values that lead to frames and files, to others by their text, and around the proxies."""
_OF_ARRAYS: Final = _words("""
    T accumulate all any argmax argmin argpartition argsort astype at choose clip compress conj conjugate
    coords copy cumprod cumsum data diagonal dot dtype fill flat flatten identity imag index item itemsize
    kind max mean min name nbytes ndim nonzero num outer partition prod put ravel real reduce repeat reshape
    round searchsorted shape signature size sort squeeze std str sum swapaxes take tobytes tolist trace
    transpose types var
""")
"""What code may use of arrays, their types and functions: nothing that frees or reinterprets memory of views.
What else NumPy has there, now or later, is refused, whatever has an attribute of this name."""
_UNSAFE_OF_ARRAYS: Final = (
    frozenset().union(*map(_public, (np.ndarray, np.dtype, np.ufunc, np.flatiter))) - _OF_ARRAYS
)
_UNSET_OF_ARRAYS: Final = _words("data dtype shape strides")
"""What code may read of an array, and not set."""
_METHODS: Final = _words("__call__ __init__ __iter__ __len__ __next__ __post_init__ __repr__ __str__")
"""Special methods that may be defined; others would see frames, or pretend to be values of other kinds."""
_OF_GENERATED: Final = _words("Proxy __file__ __name__ __package__ load_extension main")
"""Names that stand in generated code alone, as it uses them."""


def require_tame(folder: Path) -> None:
    """Raise AgentError, with file and line, unless all code in a folder with a component is tame."""
    trees: dict[str, ast.Module] = {}
    files = sorted(folder.rglob("*.py"))
    for file in files:
        if _is_installed(file.stem):
            raise AgentError.because("{file} has the name of an installed module", file=file.name)
        try:
            trees[file.stem] = ast.parse(file.read_bytes())
        except (SyntaxError, ValueError, RecursionError) as error:
            raise AgentError.because("{file} cannot be read as Python", file=file.name) from error
    beside = {name: _defined_in(tree) for name, tree in trees.items()}
    for file in files:
        for line, what in _wild(trees[file.stem], beside):
            raise AgentError.because(
                "{file}, line {line}: an agent's code may not use {what}",
                file=file.name,
                line=line,
                what=what,
            )


def identities_of(component: Path) -> frozenset[str]:
    """Return the identities of the servants that a generated component declares."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(component.read_bytes())):
        match node:
            case ast.Call(func=ast.Name(id="Proxy"), args=[ast.Constant(value=identity), *_]):
                found.add(str(identity))
    return frozenset(found)


def _wild(tree: ast.Module, beside: Mapping[str, frozenset[str]]) -> Iterator[tuple[int, str]]:
    """Yield the lines of what is not tame, and its names."""
    nodes = [*ast.walk(tree)]
    modules = {
        each.asname or each.name: each.name
        for node in nodes
        if isinstance(node, ast.Import)
        for each in node.names
    }
    known = {id(each) for node in nodes for each in (*_as_generated(node), *_of_module(node, modules))}
    for node in nodes:
        found: list[str] = []
        match node:
            case ast.Import(names=names):
                found = [each.name for each in names if each.name not in _MODULES]
            case ast.ImportFrom(module=module, names=names, level=level):
                of = module if module and not level else "."
                found = [f"{of}.{each.name}" for each in names if not _may_import(of, each, beside)]
            case ast.Name(id=name) if id(node) not in known:
                bad = name in _NAMES or name in _OF_GENERATED or name in modules
                found = [name] if bad or name.startswith("__") or name.endswith("Prx") else []
            case ast.Attribute(attr=name, ctx=context) if id(node) not in known:
                bad = not _may_use(name, sets=isinstance(context, ast.Store)) or isinstance(context, ast.Del)
                found = [name] if bad else []
            case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name) if name in _METHODS:
                pass
            case ast.MatchClass(kwd_attrs=names):
                found = [each for each in names if not _may_use(each)]
            case ast.Constant() | ast.Name() | ast.Attribute() | ast.keyword() | ast.alias():
                pass
            case _:  # what binds a name otherwise
                given = [
                    *getattr(node, "names", ()),
                    *(getattr(node, each, None) for each in ("name", "arg", "rest")),
                ]
                found = [
                    each
                    for each in given
                    if isinstance(each, str)
                    and (each in _OF_GENERATED or each in modules or each.startswith("__"))
                ]
        yield from ((getattr(node, "lineno", 0), name) for name in found)


def _of_module(node: ast.AST, modules: Mapping[str, str]) -> Iterator[ast.AST]:
    """Yield the parts of `module.name` with a name of its list."""
    path: list[ast.Attribute] = []
    while isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Load):
        path.insert(0, node)
        node = node.value
    if not isinstance(node, ast.Name) or node.id not in modules or not path:
        return
    module, name = modules[node.id], ".".join(each.attr for each in path)
    if name in _MODULES.get(module, ()) or (module == "cv2" and _CONSTANTS.fullmatch(name)):
        yield from (node, *path)


def _as_generated(node: ast.AST) -> Iterator[ast.AST]:
    """Yield names that may be used in this way, as generated code does, and no other."""
    match node:
        case ast.Call(
            func=ast.Name(id="load_extension") as called,
            args=[ast.Name(id="__file__") as file, ast.Name(id="__package__") as package, *rest],
            keywords=[],
        ) if all(isinstance(each, ast.Constant) and str(each.value).isidentifier() for each in rest):
            yield from (called, file, package)
        case ast.Call(func=ast.Name(id="Proxy") as called, args=[ast.Constant(), ast.Name() as kind]):
            yield from (called, kind)
        case ast.If(
            test=ast.Compare(
                left=ast.Name(id="__name__") as name, ops=[ast.Eq()], comparators=[ast.Constant("__main__")]
            ),
            body=[ast.Expr(ast.Call(func=ast.Name(id="main") as called, args=[ast.Name()]))],
        ):
            yield from (name, called)
        case ast.Call(
            func=ast.Name(id="getattr") as called,
            args=[ast.Name(id="self"), ast.JoinedStr(values=[*_, ast.Constant(value=str() as end)]), *_],
        ) if end.endswith(("Motors", "Encoders")):  # what is not a user's ends otherwise
            yield called
        case ast.Call(
            func=ast.Name(id="getattr" | "setattr" as how) as called,
            args=[_, ast.Constant(value=str() as attribute), *_],
        ) if _may_use(attribute, sets=how == "setattr"):
            yield called


def _may_use(attribute: str, *, sets: bool = False) -> bool:
    """Return whether an attribute of a value may be read, or set."""
    if _ATTRIBUTES.fullmatch(attribute) or attribute in _UNSAFE_OF_ARRAYS:
        return False
    return not (sets and attribute in _UNSET_OF_ARRAYS)


def _may_import(module: str, name: ast.alias, beside: Mapping[str, frozenset[str]]) -> bool:
    """Return whether a name of a module may be imported."""
    bound, first = name.asname or name.name, module.partition(".")[0]
    if bound in _OF_GENERATED | _NAMES or bound.startswith("__"):
        return module == "hfsm_runtime" and name.name == bound in _OF_RUNTIME
    if first == "interfaces":
        return name.name[0].isupper() and name.name.endswith("Prx") == bound.endswith("Prx")
    if module == "hfsm_runtime":
        return name.name in _OF_RUNTIME and not name.asname
    return name.name in _MODULES.get(module, beside.get(module, frozenset()))


def _defined_in(tree: ast.Module) -> frozenset[str]:
    """Return the names of functions and classes of a module, and of what it assigns: not what it imports."""
    named = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef
    found = {node.name for node in tree.body if isinstance(node, named)}
    targets = (each for node in tree.body if isinstance(node, ast.Assign) for each in node.targets)
    return frozenset(found | {each.id for each in targets if isinstance(each, ast.Name)})


def _is_installed(module: str) -> bool:
    """Return whether a name is that of another module than one beside the component."""
    places = [each for each in sys.path if each and Path(each).resolve() != Path.cwd()]
    found = PathFinder.find_spec(module, places)
    known = (
        module in sys.stdlib_module_names
        or module in _MODULES
        or hasattr(sys.modules.get(module), "__path__")
    )
    return known or bool(found and found.origin)
