"""The stubs that jedi reads instead of `zenoh_ice.generated` are correct."""

from __future__ import annotations

import ast
import inspect
from pathlib import Path

import pytest

import visualhfsm.project._code_help
from zenoh_ice import generated
from zenoh_ice.objects import proxy, streams

STUB = Path(visualhfsm.project._code_help.__file__).parent / "stubs" / "zenoh_ice-stubs" / "generated.pyi"
CLASSES = {node.name: node for node in ast.parse(STUB.read_text()).body if isinstance(node, ast.ClassDef)}
RELAYED = {"call_encoded", "begin_encoded"}
"""What transports use that relay calls of others: completion does not offer it."""
REAL = {"Call": proxy.Call, "StreamedCall": proxy.StreamedCall, "Sample": streams.Sample}


@pytest.mark.parametrize("name", REAL)
def test_a_class_has_the_members_of_the_real_one(name: str) -> None:
    members = {node.name: node for node in CLASSES[name].body if isinstance(node, ast.FunctionDef)}
    fields = {
        node.target.id
        for node in CLASSES[name].body
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name)
    }
    real = {each for each in [*vars(REAL[name]), *REAL[name].__annotations__] if not each.startswith("_")}
    real -= RELAYED
    assert {each for each in members.keys() | fields if not each.startswith("_")} == real
    for each, node in members.items():
        if each in vars(REAL[name]) and inspect.isfunction(vars(REAL[name])[each]):
            arguments = node.args
            written = [*arguments.args, arguments.vararg, *arguments.kwonlyargs, arguments.kwarg]
            found = list(inspect.signature(getattr(REAL[name], each)).parameters)
            assert [argument.arg for argument in written if argument is not None] == found


def test_what_declares_operations_is_there() -> None:
    declared = {node.name for node in ast.parse(STUB.read_text()).body if isinstance(node, ast.FunctionDef)}
    assert declared == {"operation", "stream"} <= set(generated.__all__)
