"""What the checks know of streams is what streams have."""

from __future__ import annotations

import inspect

from codegen.hfsm.checks.attributes import STREAM
from zenoh_ice.proxy import StreamedCall


def test_streams_are_known_as_they_are() -> None:
    methods = {name: method for name, method in vars(StreamedCall).items() if not name.startswith("_")}
    assert set(STREAM) == set(methods)
    for name, method in methods.items():
        parameters = list(inspect.signature(method).parameters.values())[1:]
        by_position = tuple(each.name for each in parameters if each.kind is not each.KEYWORD_ONLY)
        by_name = frozenset(each.name for each in parameters if each.kind is each.KEYWORD_ONLY)
        required = sum(each.default is each.empty for each in parameters)
        known = STREAM[name]
        assert (known.parameters, known.by_name, known.required) == (by_position, by_name, required)
