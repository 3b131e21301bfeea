"""The table of what code may name and call so that a cycle certainly ends within its period.

It is closed: whatever is not here may take longer, or forever. `_durations` says how code may combine it.
"""

from __future__ import annotations

import builtins
from typing import Final

_NAMES: Final = {
    "": "abs all any bool chr complex dict divmod enumerate filter float frozenset getattr hasattr id int "
    "isinstance issubclass iter len list map max min next object open ord print property range repr reversed "
    "round set slice sorted staticmethod str sum tuple type zip",
    "cmath": "cos e exp inf isfinite phase pi polar rect sin sqrt tau",
    "collections": "Counter deque",
    "copy": "copy deepcopy",
    "cv2": "absdiff arcLength bitwise_and bitwise_not bitwise_or boundingRect circle contourArea convexHull "
    "countNonZero cvtColor dilate drawContours erode findContours flip inRange line mean merge minAreaRect "
    "minEnclosingCircle minMaxLoc moments morphologyEx putText rectangle split",
    "dataclasses": "dataclass",
    "datetime": "date.today datetime.now timedelta",
    "enum": "Enum IntEnum StrEnum auto",
    "functools": "cache cached_property lru_cache",
    "json": "dumps load loads",
    "math": "acos asin atan atan2 ceil copysign cos cosh degrees dist e exp fabs floor fmod fsum hypot inf "
    "isclose isfinite isinf isnan log log10 log2 modf nan pi pow radians sin sinh sqrt tan tanh tau trunc",
    "numpy": "abs all any arctan2 argmax argmin array asarray clip cos count_nonzero float32 float64 "
    "frombuffer hypot int32 int64 isnan linalg.norm max mean median min nonzero ones ones_like pi sin sqrt "
    "std sum uint8 where zeros zeros_like",
    "os": "environ getpid path.basename path.exists path.isfile path.join",
    "pathlib": "Path",
    "random": "choice gauss randint random randrange uniform",
    "threading": "Event Lock RLock Thread Timer",
    "time": "monotonic perf_counter time",
    "uuid": "uuid4",
}
"""Functions, classes and constants by their modules."""
_METHODS: Final = frozenset(
    {
        *("add", "all", "any", "append", "appendleft", "argmax", "argmin", "astype", "cancel", "clear"),
        *("conjugate", "copy", "count", "difference", "discard", "endswith", "exists", "extend", "find"),
        *("flatten", "get", "index", "insert", "intersection", "is_alive", "is_file", "is_set", "isalnum"),
        *("isalpha", "isdigit", "isspace", "issubset", "isupper", "item", "items", "join", "keys"),
        *("latest", "lower", "lstrip", "max", "mean", "min", "partition", "pop", "popleft", "publish"),
        *("read", "readline", "readlines", "remove", "removeprefix", "removesuffix", "replace", "reshape"),
        *("reverse", "rstrip", "set", "setdefault", "sort", "split", "splitlines", "start", "startswith"),
        *("std", "strip", "sum", "title", "tolist", "total_seconds", "union", "update", "upper", "values"),
    }
)
"""Methods of what the functions make, of literals, and of what servants answer, whichever object has them."""
OF_COMPONENT: Final = frozenset(
    {
        *("clock.now", "log.critical", "log.debug", "log.error", "log.exception", "log.info"),
        *("log.warning", "mark", "send"),
    }
)
"""What the component has by itself."""
ENDING: Final = frozenset(
    {
        *("KeyboardInterrupt", "SystemExit", "exit", "os._exit", "os.abort", "quit", "sys.exit"),
    }
)
"""What ends the component, but no cycle later."""
LOADED: Final = frozenset(
    {
        *("collections", "copy", "dataclasses", "datetime", "enum", "functools", "json", "math", "os"),
        *("os.path", "pathlib", "random", "sys", "threading", "time", "uuid"),
    }
)
"""Modules of Python that are small, and that most components have imported: to import them takes no time."""
BASES: Final = frozenset({"Exception", "enum.Enum", "enum.IntEnum", "enum.StrEnum", "object"})
"""Classes that those of the document may extend."""
DECORATORS: Final = frozenset(
    {"functools.cache", "functools.cached_property", "functools.lru_cache", "property", "staticmethod"}
)
LOCKS: Final = frozenset({"threading.Lock", "threading.RLock"})
CALLED: Final = frozenset(
    {
        *("abs", "bool", "float", "int", "len", "list", "max", "min", "round", "set", "sorted", "str"),
        *("sum", "tuple"),
    }
)
"""Functions that others may be given to call."""
STORING: Final = frozenset(
    {
        *("add", "append", "appendleft", "clear", "discard", "extend", "insert", "pop", "popitem"),
        *("popleft", "remove", "reverse", "setdefault", "sort", "update"),
    }
)
"""Methods that change their object."""
KEEPING: Final = STORING - {"extend", "update"} | frozenset(
    {
        *("Thread", "Timer", "abs", "all", "any", "bool", "cancel", "copy", "count", "debug", "deepcopy"),
        *("endswith", "enumerate", "error", "exception", "filter", "float", "frozenset", "get", "getattr"),
        *("hasattr", "id", "index", "info", "int", "is_alive", "is_set", "isalpha", "isdigit"),
        *("isinstance", "items", "iter", "keys", "len", "list", "map", "mark", "max", "min", "next"),
        *("print", "publish", "range", "reversed", "round", "send", "set", "sorted", "start", "startswith"),
        *("sum", "tuple", "type", "values", "warning", "zip"),
    }
)
"""Functions and methods that make nothing larger than the largest thing that they are given."""
CALCULATING: Final = ("cmath.", "cv2.", "math.", "numpy.linalg", "numpy.m", "numpy.u", "numpy.z")
"""Functions of numbers and of pictures, whose results have the size of what they are given at most."""
_NO_FLOATS: Final = frozenset({"cmath.polar", "math.ceil", "math.floor", "math.modf", "math.trunc"})


def is_quick_name(full: str) -> bool:
    """Return whether something of Python or of a library, by its full name, is in the table."""
    module, _, name = full.partition(".")
    if not name:
        found: object = getattr(builtins, full, None)
        is_error = isinstance(found, type) and issubclass(found, Exception)
        return is_error or full in _NAMES[""].split()
    if module == "interfaces":
        return "Prx" not in name and "_" not in name
    return (module == "cv2" and name.isupper()) or name in _NAMES.get(module, "").split()


def is_quick_method(name: str) -> bool:
    """Return whether methods of this name are in the table."""
    return name in _METHODS


def gives_float(full: str) -> bool:
    """Return whether a function gives a float, or a complex number."""
    is_one = full in ("complex", "float", "random.gauss", "random.random", "random.uniform", "self.clock.now")
    return (is_one or full.startswith(("math.", "cmath.", "time."))) and full not in _NO_FLOATS
