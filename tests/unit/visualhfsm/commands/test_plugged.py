"""Commands of plug-ins: found when they are named, and no harm to others when they are broken."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tests.support.commands import run_here
from tests.support.plugins import installed, without
from visualhfsm import VisualHfsmError
from visualhfsm._commands import plugged as module
from visualhfsm._commands.app import app

DANCE = """
import typer

app = typer.Typer(add_completion=False)

@app.command()
def dance(partner: str) -> None:
    '''Dance
    with somebody.'''
    typer.echo(f"dances with {partner}")
"""


@pytest.fixture(autouse=True)
def forget():
    """Let each test find its own plug-ins."""
    module._plugged.cache_clear()
    yield
    module._plugged.cache_clear()


def test_run_says_what_runs_a_document_unless_a_plug_in_does(tmp_path: Path) -> None:
    refused = CliRunner().invoke(app, ["run", "--realm", "nao2", "one goes.xml"], prog_name="visualhfsm")
    assert "codegen 'one goes.xml', and then: python 'one goes.py'" in " ".join(
        refused.stderr.replace("│", "").split()
    )
    with installed(tmp_path, {"visualhfsm.commands": {"run": "stranger:app"}}, stranger=DANCE):
        module._plugged.cache_clear()
        assert run_here(app, "visualhfsm", "run", "Nao").stdout == "dances with Nao\n"


def test_a_command_is_listed_and_runs_and_costs_others_nothing(tmp_path: Path) -> None:
    with installed(tmp_path, {"visualhfsm.commands": {"dance": "stranger:app"}}, stranger=DANCE):
        assert run_here(app, "visualhfsm", "new", "--help").returncode == 0
        assert "stranger" not in sys.modules
        assert "Dance with somebody." in run_here(app, "visualhfsm", "--help").stdout
        assert run_here(app, "visualhfsm", "dance", "Nao").stdout == "dances with Nao\n"


def test_a_command_that_cannot_be_loaded_says_why_and_leaves_the_others(tmp_path: Path) -> None:
    with installed(tmp_path, {"visualhfsm.commands": {"dance": "stranger:app"}}, stranger="import wheels"):
        listed = run_here(app, "visualhfsm", "--help")
        assert "No module named 'wheels'" in " ".join(listed.stdout.split())
        assert "convert" in listed.stdout
        done = run_here(app, "visualhfsm", "dance", "--fast", expected=(VisualHfsmError,))
    assert done.returncode == 1
    assert "the plug-in dance of a-stranger (stranger:app) cannot be loaded" in done.stderr


def test_a_command_that_ends_the_program_while_it_is_loaded_leaves_the_others(tmp_path: Path) -> None:
    leaves = "raise SystemExit('no wheels')"
    with installed(tmp_path, {"visualhfsm.commands": {"dance": "stranger:app"}}, stranger=leaves):
        listed = run_here(app, "visualhfsm", "--help")
    assert listed.returncode == 0
    assert "cannot be loaded: no wheels" in " ".join(listed.stdout.split())


def test_what_is_no_command_is_named(tmp_path: Path) -> None:
    with installed(tmp_path, {"visualhfsm.commands": {"dance": "stranger:app"}}, stranger="app = 1"):
        done = run_here(app, "visualhfsm", "dance", expected=(VisualHfsmError,))
    assert done.returncode == 1
    assert "dance of visualhfsm.commands is no application of typer with one command" in done.stderr


def test_a_folder_for_a_pupil_without_its_plug_in_says_what_to_install(tmp_path: Path) -> None:
    with without("visualhfsm_classes"):
        refused = run_here(
            app, "visualhfsm", "new", tmp_path / "ana", "--exercise", "look", expected=(VisualHfsmError,)
        )
        assert run_here(app, "visualhfsm", "new", tmp_path / "mine").returncode == 0
    assert refused.returncode == 1
    assert "visualhfsm_classes is not installed; type: pip install 'visualhfsm[classes]'" in refused.stderr
    assert not (tmp_path / "ana").exists()


def test_a_file_in_place_of_a_command_leads_to_edit(tmp_path: Path) -> None:
    document = tmp_path / "my dance.xml"
    document.touch()
    refused = CliRunner().invoke(app, [str(document)], env={"COLUMNS": "300"})
    assert refused.exit_code == 2
    assert f"visualhfsm edit '{document}'" in refused.output
    for absent in ("absent.xml", 300 * "a"):  # a name that no file may have
        refused = CliRunner().invoke(app, [absent], env={"COLUMNS": "400"})
        assert f"No such command '{absent}'" in refused.output
