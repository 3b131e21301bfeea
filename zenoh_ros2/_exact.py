"""Which messages have exactly the values that the codec writes.

rosbags copies arrays as their bytes, whatever they mean, and takes any object for a bool. So what was
assigned to a message is looked at before it is written: all but these values are converted first, or refused.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, Final

import numpy as np
from rosbags.interfaces import Nodetype

Check = Callable[[Any], bool]

ARRAYS: Final = {"byte": "int8", "bool": "bool_"}
"""Names of elements in NumPy that differ."""
_SCALARS: Final[dict[str, type]] = {"bool": bool, "float32": float, "float64": float}  # others are whole


def exact(cls: Any, fields: Iterable[tuple[str, Any]], of_message: Callable[[str], Check]) -> Check:  # noqa: ANN401
    """Return a check of messages of a class; `of_message` returns that of messages in them, by name."""
    checks = [(field, _of_value(kind, of_message)) for field, kind in fields]

    def check(message: Any) -> bool:  # noqa: ANN401
        values = vars(message) if type(message) is cls else {}
        return len(values) == len(cls.__match_args__) and all(fits(values.get(each)) for each, fits in checks)

    return check


def _of_value(kind: Any, of_message: Callable[[str], Check]) -> Check:  # noqa: ANN401
    node, detail = kind
    if node == Nodetype.NAME:
        return of_message(detail)
    if node == Nodetype.BASE:
        name, limit = detail
        if name == "string":
            return lambda text: type(text) is str and "\0" not in text and not limit
        wanted = _SCALARS.get(name, int)
        return lambda value: type(value) is wanted
    element, count = detail
    least, most = count if node == Nodetype.ARRAY else 0, count or 1 << 32
    if element[0] == Nodetype.BASE and element[1][0] != "string":
        dtype = np.dtype(ARRAYS.get(element[1][0], element[1][0]))
        return lambda a: (
            type(a) is np.ndarray
            and a.dtype == dtype
            and a.ndim == 1
            and a.flags.c_contiguous
            and least <= len(a) <= most
        )
    fits = _of_value(element, of_message)
    return lambda values: type(values) is list and least <= len(values) <= most and all(map(fits, values))
