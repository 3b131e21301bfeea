"""`visualhfsm verdict FILES...`: ready to drive a robot, or what to fix first."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from codegen.options import require_directories
from visualhfsm._base.options import Include, examples
from visualhfsm._commands.check import documents_of
from zenoh_ice.application.cli import finite, unwind_on_signals
from zenoh_ice.data.text import few

if TYPE_CHECKING:
    from visualhfsm import Verdict

EPILOG: Final = examples(
    "verdict behaviors/follow_ball.xml",
    "verdict behaviors --seconds 30",
    "verdict behaviors/score.xml --body T1",
    "verdict dance.xml --json",
    "verdict --schema",
    notes="Exit codes: 0 all are ready, 1 something is not, 2 wrong usage.",
)


def verdict(
    files: Annotated[
        list[Path] | None,
        typer.Argument(metavar="FILES", help="Documents (.xml), or directories that contain some."),
    ] = None,
    include: Include = None,
    *,
    seconds: Annotated[
        float,
        typer.Option(metavar="S", min=0.1, max=3600.0, callback=finite, help="Virtual time of the run."),
    ] = 10.0,
    patience: Annotated[
        float,
        typer.Option(
            metavar="S",
            min=1.0,
            max=86_400.0,
            callback=finite,
            help="Time of the run, of all failures, and of the tests.",
        ),
    ] = 60.0,
    body: Annotated[
        str, typer.Option("--body", metavar="NAME|FILE", help="Robot of the run.", show_default="a Nao")
    ] = "",
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON, by the schema of --schema.")] = False,
    schema: Annotated[bool, typer.Option("--schema", help="Print the JSON schema, and end.")] = False,
) -> None:
    """Say whether documents are ready to drive a robot, or what is not, in the order of what to fix first.

    Checks and the model checker look at them, they run in virtual time with a robot without physics, they are
    tried with each failure of the robot that they must survive, and their tests are run. No code of a
    document with errors is run. What the model checker cannot decide is said, and leaves a document ready.
    """
    import msgspec

    from visualhfsm import Project, Reason, Verdict
    from visualhfsm._base.errors import VisualHfsmError

    if schema:
        typer.echo(msgspec.json.format(msgspec.json.encode(msgspec.json.schema(list[Verdict]))).decode())
        return
    if not files:
        raise typer.BadParameter("give a document, or --schema", param_hint="FILES")
    if body:
        _require(body)
    paths = [*documents_of(files)]
    verdicts = []
    with unwind_on_signals(), Project(include=require_directories(include), granted=paths) as project:
        for path in paths:
            try:
                verdicts.append(project.open(path).verdict(seconds=seconds, patience=patience, body=body))
            except VisualHfsmError as error:
                reason = Reason(found="checks", message=error.message, file=path.name)
                verdicts.append(Verdict(document=path.name, ready=False, reasons=(reason,)))
            if not as_json:
                typer.echo(_text(path, verdicts[-1]))
    if as_json:
        typer.echo(msgspec.json.format(msgspec.json.encode(verdicts, enc_hook=str)).decode())
    if not all(each.ready for each in verdicts):
        raise typer.Exit(1)


def _require(body: str) -> None:
    """Raise BadParameter for a robot that is not known: no document could be ready for it."""
    from visualhfsm.simulation import RobotError, named_body

    try:
        named_body(body)
    except RobotError as error:
        raise typer.BadParameter(str(error), param_hint="--body") from error


def _text(path: Path, verdict: Verdict) -> str:
    done = f"ran {verdict.seconds:g} s, {len(verdict.proved)} proved, {verdict.tests} tests"
    done += f", {len(verdict.survivals)} survived" if verdict.survivals else ""
    is_shown = verdict.proved or verdict.tests
    found = f"{'ready' if is_shown else 'runs, and is not tested yet'}: {done}"
    lines = [f"{path}: {found if verdict.ready else 'not ready'}"]
    if verdict.ready and not is_shown:
        lines.append("  without a test or a proved property nothing shows that it does what it should")
    if verdict.missed:
        lines.append(f"  the run never stayed in {few(verdict.missed, 8)}")
    lines += [f"  survived: {each.text}" for each in verdict.survivals if each.held]
    lines += [f"  {verdict.never_tried.text}"] if verdict.never_tried else []
    for number, each in enumerate((*verdict.reasons, *verdict.warnings), 1):
        head = f"{number}." if number <= len(verdict.reasons) else "warning:"
        text = each.text.replace("\n", "\n       ")
        lines += [f"  {head} {text}", *(f"       {step}" for step in each.steps)]
        lines += [f"     > {hint}" for hint in each.hints]
    lines += [f"  undecided by the model checker: `{name}`" for name in verdict.undecided]
    held = "violated if certain guards ever hold, which the run has not shown"
    return "\n".join((*lines, *(f"  {held}: `{name}`" for name in verdict.not_shown)))
