"""Which messages have exactly the values that the codec writes.

rosbags copies arrays as their bytes, whatever they mean, and takes any object for a bool. So what was
assigned to a message is looked at before it is written: all but these values are converted first, or refused.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, Final

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.typesys.store import Typestore

Check = Callable[[Any], bool]

ARRAYS: Final = {"byte": "int8", "bool": "bool_"}
"""Names of elements in NumPy that differ."""
ZEROS: Final[dict[str, Any]] = {
    "string": "",
    "bool": False,
    "float32": 0.0,
    "float64": 0.0,
}  # others are whole


def exact(name: str, store: Typestore) -> Check:
    """Return a check of messages of a store, by their name; it raises AttributeError for a missing field.

    It is compiled from the definition, as rosbags' codec is: else it would take longer than that.
    """
    scope: dict[str, Any] = {"ndarray": np.ndarray}
    conditions = " and ".join(_of_value("message", (Nodetype.NAME, name), store, scope))
    check: Check = eval(f"lambda message: {conditions}", scope)  # noqa: S307 - of names in definitions
    return check


def _of_value(value: str, kind: Any, store: Typestore, scope: dict[str, Any]) -> Iterator[str]:  # noqa: ANN401
    """Yield the conditions of a value, whose expression is given; the scope gets what they need."""
    node, detail = kind
    number = len(scope)
    if node == Nodetype.NAME:
        cls: Any = store.types[detail]
        scope[f"class_{number}"] = cls
        yield f"type(m{number} := {value}) is class_{number}"
        yield f"len(m{number}.__dict__) == {len(cls.__match_args__)}"
        for attribute, (_, each) in zip(cls.__match_args__, store.fielddefs[detail][1], strict=False):
            yield from _of_value(f"m{number}.{attribute}", each, store, scope)
    elif node == Nodetype.BASE and detail[0] == "string":
        yield "False" if detail[1] else f"type(text := {value}) is str and '\\0' not in text"
    elif node == Nodetype.BASE:
        yield f"type({value}) is {type(ZEROS.get(detail[0], 0)).__name__}"
    else:
        element, count = detail
        least, most = count if node == Nodetype.ARRAY else 0, count or 1 << 32
        is_number = element[0] == Nodetype.BASE and element[1][0] != "string"
        yield f"type(values := {value}) is {'ndarray' if is_number else 'list'}"
        if is_number:
            scope[f"dtype_{number}"] = np.dtype(ARRAYS.get(element[1][0], element[1][0]))
            yield f"values.dtype == dtype_{number} and values.ndim == 1 and values.flags.c_contiguous"
        elif element[0] == Nodetype.NAME:
            scope[f"fits_{number}"] = exact(element[1], store)
            yield f"all(map(fits_{number}, values))"
        else:
            yield (
                "False" if element[1][1] else "{*map(type, values)} <= {str} and '\\0' not in ''.join(values)"
            )
        yield f"{least} <= len(values) <= {most}"
