"""The stacks that `nao stack` knows by name: each command is one that its program takes."""

from __future__ import annotations

from importlib import import_module
from importlib.metadata import entry_points
from importlib.util import find_spec
from pathlib import Path

import pytest
from typer.testing import CliRunner

from nao_tools._deployment.stack import Stack, load_stack, stack_path
from tests.support.security import Keys

APPS = {
    "ballmover": "ballmover._cli",
    "nao": "nao_tools._command",
    "naoserver-naoqi": "visualhfsm_naoqi.robot._command",
    "naoserver-sim": "naoserver_sim._command",
    "visualhfsm": "visualhfsm._commands.app",
}
STACKS = {name: load_stack(stack_path(name)) for name in ("sim", "nao", "lab")}
PARTS = [(stack, machine) for stack in STACKS.values() for machine in stack.machines or [""]]


@pytest.fixture(scope="module")
def keys(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return Keys(tmp_path_factory.mktemp("keys")).folder


@pytest.mark.slow
@pytest.mark.parametrize(
    ("stack", "machine"), PARTS, ids=[f"{stack.name}-{machine}" for stack, machine in PARTS]
)
def test_every_command_is_one_that_its_program_takes(stack: Stack, machine: str, keys: Path) -> None:
    changes = {"keys": str(keys)} if "keys" in stack.variables else {}
    for process in stack.on_machine(machine).with_variables(changes):
        program, *arguments = process.command
        if program == "naoserver-naoqi":
            pytest.importorskip("qi")
            pytest.importorskip("visualhfsm_naoqi", reason="the real Nao is that of a plug-in")
        # With this option it reads its settings, prints them and ends.
        outcome = CliRunner().invoke(import_module(APPS[program]).app, [*arguments, "--show-config"])
        assert outcome.exit_code == 0, f"{process.name}: {outcome.output}"


def test_every_program_is_a_command_of_an_installation() -> None:
    installed = {each.name for each in entry_points(group="console_scripts")}
    of_plug_ins = set() if find_spec("visualhfsm_naoqi") else {"naoserver-naoqi"}
    assert set(APPS) - of_plug_ins <= installed


def test_from_the_simulation_to_the_robot_one_word_changes() -> None:
    simulated, real = STACKS["sim"], STACKS["nao"]
    assert simulated.endpoint == real.endpoint
    assert simulated.processes[-1] == real.processes[-1]  # the editor
    assert {simulated.processes[0].name, real.processes[0].name} == {"naoserver"}


def test_nothing_that_moves_the_robot_is_restarted() -> None:
    restarted = [
        each for stack in STACKS.values() for each in stack.processes if each.restart == "on-failure"
    ]
    assert {each.command[0] for each in restarted} == {
        "ballmover", "nao", "naoserver-naoqi", "naoserver-sim", "visualhfsm",
    }  # fmt: skip
    assert [each.name for each in restarted if "--start" in each.command] == []
