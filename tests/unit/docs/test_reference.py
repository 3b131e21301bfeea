"""The tables that docs/hooks.py generates from the code are complete, and the pages show all of them."""

from __future__ import annotations

import importlib
import inspect
import re
from functools import cache
from typing import get_args

import pytest
import typer

from codegen._idl.report import Code as InterfaceCode
from codegen.hfsm.codes import Code as DocumentCode
from tests.support.pages import DOCS, pages
from tests.support.plugins import OF_THE_WHOLE, needs
from tools.workspace import DISTRIBUTIONS
from visualhfsm._document.commands import COMMANDS
from visualhfsm._editor.protocol import Request
from visualhfsm._monitor.messages import Push

hooks = pytest.importorskip("docs.hooks", reason="needs the packages of visualhfsm[docs]")

SCRIPTS = {name for each in DISTRIBUTIONS for name in each.project.get("scripts", ())}


def first_column(table: str) -> list[str]:
    return re.findall(r"^\| [`\[]([\w.]+)", table, re.MULTILINE)


@needs("visualhfsm_naoqi")  # one of whose pages has a table, too
def test_pages_show_all_that_is_generated_and_nothing_else() -> None:
    shown = [
        name
        for page in pages(".")
        for name in re.findall(r"<!-- generated: (.*?) -->", (DOCS / page).read_text("utf-8"))
    ]
    assert sorted(shown) == sorted(hooks.GENERATED)


def test_every_command_is_listed_with_its_options() -> None:
    pytest.importorskip("qi")
    assert set(hooks.COMMANDS) == SCRIPTS
    text = hooks.commands()
    for name, module in hooks.COMMANDS.items():
        assert f"## {name}\n" in text
        command = typer.main.get_command(importlib.import_module(module).app)
        commands = [command, *getattr(command, "commands", {}).values()]
        shown = [each for each in commands if not each.hidden]
        options = {
            option for each in shown for param in each.params if not param.hidden for option in param.opts
        }
        own = {each for each in options if each.startswith("--")} - set(hooks.shared_options()) - {"--help"}
        assert [option for option in sorted(own) if option not in text] == []


@cache
def listed_exceptions() -> set[str]:
    return set(re.findall(r"^ *- `(\w+)`", hooks.exceptions(), re.MULTILINE))


@pytest.mark.parametrize(
    "module",
    [
        "ballmover._exceptions",
        "hfsm_runtime.errors",
        "interfaces.jderobot.common",
        "naoserver.errors",
        "visualhfsm._base.errors",
        "zenoh_ice.data.exceptions",
    ],
)
def test_every_exception_is_listed(module: str) -> None:
    found = {
        name
        for name, each in vars(importlib.import_module(module)).items()
        if inspect.isclass(each) and issubclass(each, BaseException) and not name.startswith("_")
    }
    assert found
    assert found - listed_exceptions() == set()


def test_every_code_is_listed_once() -> None:
    assert first_column(hooks.diagnostics()) == [*InterfaceCode, *DocumentCode]


@OF_THE_WHOLE
def test_every_message_is_listed() -> None:
    requests = {each.__struct_config__.tag: each for each in get_args(Request)}
    rows = dict(re.findall(r"^\| `(\w+)` \|(.*?)\|", hooks.requests(), re.MULTILINE))
    assert list(rows) == list(requests)
    fields = {name: {*each.__struct_encode_fields__} - {"id"} for name, each in requests.items()}
    assert {name: {*re.findall(r"`(\w+)`", row)} & fields[name] for name, row in rows.items()} == fields
    pushes = set(first_column(hooks.pushes()))  # loads the modules that have some
    assert pushes == {each.__struct_config__.tag for each in Push.__subclasses__()}
    assert first_column(hooks.edits()) == [each.__struct_config__.tag for each in COMMANDS]
