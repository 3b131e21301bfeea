"""The table of what code may call: what waits, what ends the component, and what is certainly quick.

Warnings about code that blocks read what waits; proofs read what is quick. That part is closed: whatever is
not here may take longer than a period, or forever. `model_checker/_durations` says how code may combine it.
"""

from __future__ import annotations

import builtins
from enum import Enum
from typing import Final


class Lasts(Enum):
    """How long a call may last, of a function that has its full name."""

    QUICK = "it takes no time"
    ENDS = "the component ends, but no cycle later"
    SLEEPS = "as long as its argument says"
    WAITS = "until a person or another program acts"
    WAITS_WITHOUT_TIMEOUT = "until another program acts, or a time is over that is passed as `timeout`"
    UNKNOWN = "it may last forever"


def _names(*lines: str) -> frozenset[str]:
    return frozenset(" ".join(lines).split())


_QUICK: Final = {
    "": "abs all any bool chr complex dict divmod enumerate filter float frozenset getattr hasattr id int "
    "isinstance issubclass len list map max min next object open ord print property range repr reversed "
    "round set slice sorted staticmethod str sum tuple zip",
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
    "self": "clock.now log.critical log.debug log.error log.exception log.info log.warning mark send",
    "threading": "Lock RLock Thread",
    "time": "monotonic perf_counter time",
    "uuid": "uuid4",
}
"""Functions, classes and constants by their modules, and what the component has by itself."""
_OTHERS: Final = {
    Lasts.ENDS: _names("KeyboardInterrupt SystemExit exit os._exit os.abort quit sys.exit"),
    Lasts.SLEEPS: _names("self.clock.sleep self.sleep time.sleep"),
    Lasts.WAITS: _names(
        "getpass.getpass input os.system os.wait os.waitpid signal.pause sys.stdin.read sys.stdin.readline"
    ),
    Lasts.WAITS_WITHOUT_TIMEOUT: _names(
        "requests.delete requests.get requests.head requests.patch requests.post requests.put",
        "requests.request socket.create_connection subprocess.call subprocess.check_call",
        "subprocess.check_output subprocess.run urllib.request.urlopen",
    ),
}
_TABLE: Final = {
    **{f"{at}.{name}".strip("."): Lasts.QUICK for at, names in _QUICK.items() for name in _names(names)},
    **{name: how for how, names in _OTHERS.items() for name in names},
}
QUICK_METHODS: Final = _names(
    "add all any append appendleft argmax argmin astype cancel clear conjugate copy count difference discard",
    "endswith exists extend find flatten get index insert intersection is_file isalnum isalpha isdigit",
    "isspace issubset isupper item items join keys latest lower lstrip max mean min partition pop popleft",
    "publish read readline readlines remove removeprefix removesuffix replace reshape reverse rstrip",
    "setdefault sort split splitlines start startswith std strip sum title tolist total_seconds union",
    "update upper values",
)
"""Methods of what the functions make, of literals, and of what servants answer, whichever object has them."""
LOADED: Final = _names(
    "collections copy dataclasses datetime enum functools json math os os.path pathlib random sys threading",
    "time uuid",
)
"""Modules of Python that are small, and that most components have imported: to import them takes no time."""
BASES: Final = _names("Exception enum.Enum enum.IntEnum enum.StrEnum object")
"""Classes that those of the document may extend."""
DECORATORS: Final = _names(
    "functools.cache functools.cached_property functools.lru_cache property staticmethod"
)
LOCKS: Final = _names("threading.Lock threading.RLock")
CALLED: Final = _names("abs bool float int len list max min round set sorted str sum tuple")
"""Functions that others may be given to call."""
ADDING: Final = _names("add append appendleft extend insert setdefault update")
STORING: Final = ADDING | _names("clear discard pop popitem popleft remove reverse sort")
"""Methods that add to their object, and all that change it."""
KEEPING: Final = _names(
    "abs cancel copy deepcopy dict divmod enumerate filter frozenset get int items keys list lower map max",
    "min next pop popleft range reversed round set sorted sum tuple upper values zip",
)
"""Functions and methods that make nothing larger than all that they are given."""
_FIXED: Final = _names(
    "all any bool count endswith exists find hasattr id index is_file isalnum isalpha isdigit isinstance",
    "isspace issubset issubclass isupper len startswith total_seconds",
)
"""Functions and methods whose results are truth values or small numbers."""
_FLOATS: Final = _names(
    "complex float random.gauss random.random random.uniform self.clock.now time.monotonic",
    "time.perf_counter time.time",
)
_NO_FLOATS: Final = _names("cmath.polar math.ceil math.floor math.modf math.trunc")


def lasts(full: str) -> Lasts:
    """Return how long something of Python, of a library or of the component may last, by its full name."""
    module, _, name = full.partition(".")
    found: object = None if name else getattr(builtins, full, None)
    is_error = isinstance(found, type) and issubclass(found, Exception)
    is_of_interface = module == "interfaces" and bool(name) and "Prx" not in name and "_" not in name
    if is_error or is_of_interface or (module == "cv2" and name.isupper()):
        return Lasts.QUICK
    return _TABLE.get(full, Lasts.UNKNOWN)


def gives_float(full: str) -> bool:
    """Return whether a function gives a float, or a complex number."""
    return full in _FLOATS or (full.startswith(("cmath.", "math.")) and full not in _NO_FLOATS)


def has_fixed_size(full: str) -> bool:
    """Return whether a function or a method gives numbers, or a picture of the size that it is given."""
    is_of_arrays = full.startswith(("cmath.", "cv2.", "math.", "numpy.linalg", "numpy.m"))
    return is_of_arrays or full.rpartition(".")[2] in _FIXED
