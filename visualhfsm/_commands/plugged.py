"""Commands of plug-ins, each loaded when it is named, or listed.

They are entry points of the seam `visualhfsm.commands`: the name is that of the command, and stands for an
application of typer with this one command, made with `add_completion=False`.
"""

from __future__ import annotations

import os
import shlex
from functools import cache
from typing import Any, Final, NoReturn, cast

import typer
from typer.core import TyperCommand, TyperGroup

from codegen.messages import Message
from visualhfsm._base.errors import VisualHfsmError
from zenoh_ice import plugins
from zenoh_ice.application.cli import join_lines

_SEAM: Final = "visualhfsm.commands"


class WithPlugged(TyperGroup):
    """The commands of an application, and after them those of plug-ins."""

    def list_commands(self, ctx: Any) -> list[str]:  # noqa: ANN401 - typer brings a click of its own
        """Return the names of all commands."""
        own = super().list_commands(ctx)
        return [*own, *(name for name in plugins.names(_SEAM) if name not in own)]

    def get_command(self, ctx: Any, cmd_name: str) -> Any:  # noqa: ANN401
        """Return a command by its name, None if there is none."""
        return super().get_command(ctx, cmd_name) or _plugged(cmd_name)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:  # noqa: ANN401
        """Return the command that arguments begin with, and what follows.

        Names `edit` where it is a file, and what runs a document where it is `run`.
        """
        if os.path.isfile(args[0]) and self.get_command(ctx, args[0]) is None:  # noqa: PTH113 - takes any text
            ctx.fail(f"{args[0]} is a file, no command. To open it: visualhfsm edit {shlex.quote(args[0])}")
        if args[0] == "run" and self.get_command(ctx, args[0]) is None:
            name = shlex.quote(next((each for each in args if each.endswith(".xml")), "NAME.xml"))
            component = name.replace(".xml", ".py")
            ctx.fail(f"a document runs as its component: codegen {name}, and then: python {component}")
        return super().resolve_command(ctx, args)


@cache
def _plugged(name: str) -> TyperCommand | None:
    """Return the command of a plug-in; of one that is broken, a command that says so."""
    try:
        app = plugins.find(_SEAM, name)
    except plugins.PluginError as error:
        return _broken(name, str(error))
    if app is None:
        return None
    if not isinstance(app, typer.Typer) or len(app.registered_commands) != 1 or app.registered_groups:
        return _broken(name, f"{name} of {_SEAM} is no application of typer with one command")
    join_lines(app)
    return cast("TyperCommand", typer.main.get_command(app))


def _broken(name: str, why: str) -> TyperCommand:
    def refuse() -> NoReturn:
        raise VisualHfsmError(Message.verbatim(why))

    words = {"ignore_unknown_options": True, "allow_extra_args": True}
    return TyperCommand(name, callback=refuse, help=why, context_settings=words)
