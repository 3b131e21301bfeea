"""Parameters of a component as options of its command line."""

from __future__ import annotations

from typing import Any

import pytest
import typer
from typer.testing import CliRunner

from codegen.hfsm._checks.component import STANDARD_OPTIONS
from hfsm_runtime import Automaton, Component, Parameter, State
from hfsm_runtime.command import make_app, make_component, with_parameters


class Runner(Component, document="runner.xml"):
    """Run."""

    top_speed = Parameter(0.5, "How fast it goes, in m/s.")
    laps = Parameter(2)
    loud = Parameter(False, "Whether it logs.")
    settings = Parameter("plain", "A name that the command uses itself.")

    def __init__(self) -> None:
        self.seen = self.laps

    def automaton(self) -> Automaton:
        return Automaton(id=1, name="runner", states=(State(id=1, name="run", initial=True),))


def call(*arguments: str) -> tuple[int, dict[str, object], str]:
    """Run a command with the parameters; return its exit code, what they are, and what it says."""
    app = typer.Typer(add_completion=False)
    taken: dict[str, object] = {}

    @app.command()
    @with_parameters(Runner)
    def command(*, parameters: dict[str, object]) -> None:
        taken.update(parameters)

    done = CliRunner().invoke(app, list(arguments), env={"COLUMNS": "160"})
    return done.exit_code, taken, done.output


def test_defaults() -> None:
    assert call()[1] == {"top_speed": 0.5, "laps": 2, "loud": False, "settings": "plain"}


def test_each_type() -> None:
    code, taken, _ = call("--top-speed", "1e-1", "--laps=-3", "--loud", "--settings", "a b")
    assert code == 0
    assert taken == {"top_speed": 0.1, "laps": -3, "loud": True, "settings": "a b"}
    assert call("--loud", "--no-loud")[1]["loud"] is False


@pytest.mark.parametrize(
    "arguments", [("--laps", "2.5"), ("--top-speed", "nan"), ("--loud", "yes"), ("--lap",)]
)
def test_wrong_usage(arguments: tuple[str, ...]) -> None:
    assert call(*arguments)[0] == 2


def test_a_component_sees_its_parameters_from_the_start() -> None:
    made = make_component(Runner, {"laps": 7})
    assert (made.laps, made.seen, made.top_speed) == (7, 7, 0.5)


def options_of(component: type[Component]) -> dict[str, Any]:
    command = typer.main.get_command(make_app(component))
    return {
        option: parameter
        for parameter in command.params
        for option in (*parameter.opts, *parameter.secondary_opts)
    }


def test_the_command_of_a_component_has_its_parameters_with_default_and_description() -> None:
    options = options_of(Runner)
    assert {"--top-speed", "--laps", "--loud", "--no-loud", "--settings"} <= options.keys()
    shown = CliRunner().invoke(make_app(Runner), ["--help"], env={"COLUMNS": "160"}).output
    assert "How fast it goes, in m/s." in shown
    assert "0.5" in shown
    assert "--top-speed 0.5" in shown, "an example sets the first parameter"


def test_documents_are_refused_whose_parameters_are_called_like_standard_options() -> None:
    class Plain(Component, document="plain.xml"):
        """Nothing."""

    of_plug_ins = {"ros", "ros_domain", "ros_connect", "ros_namespace", "remap"}  # where these are installed
    standard = {option.removeprefix("--").replace("-", "_") for option in options_of(Plain)}
    assert standard | of_plug_ins | {"help"} == STANDARD_OPTIONS
