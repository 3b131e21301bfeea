"""The page about settings: it has every setting with its default and its flag, and nothing else."""

from __future__ import annotations

import re

import pytest
import typer

from hfsm_command.cli import with_settings
from tests.support.pages import DOCS
from zenoh_ice.settings import PROTOCOLS, Security, Settings

TEXT = (DOCS / "reference/settings.md").read_text("utf-8")
ROWS = {
    name: (default.strip(), flag.strip(" `"))
    for name, default, flag in re.findall(r"^\| `([\w.]+)` \|([^|]*)\|([^|]*)\|", TEXT, re.M)
}


def flags() -> set[str]:
    app = typer.Typer(add_completion=False)

    @app.command()
    @with_settings()
    def command(*, settings: Settings) -> None: ...

    return {option for parameter in typer.main.get_command(app).params for option in parameter.opts}


def test_every_setting_has_its_row() -> None:
    own = [name for name in Settings.__struct_fields__ if name != "security"]
    assert list(ROWS) == own + [f"security.{name}" for name in Security.__struct_fields__]


@pytest.mark.parametrize("name", list(ROWS))
def test_defaults(name: str) -> None:
    settings = Settings()
    value = (
        getattr(settings.security, name.removeprefix("security."), None)
        if "." in name
        else getattr(settings, name)
    )
    match value:
        case bool():
            shown = str(value).lower()
        case int() if value >= 1 << 20:
            shown = f"{value >> 20} MiB"
        case float():
            shown = f"{value:g} s"
        case int():
            shown = str(value)
        case tuple():
            shown = ", ".join(f"`{item}`" for item in value)
        case _:
            shown = f"`{value}`" if value else ""
    assert ROWS[name][0] == shown


def test_every_flag_has_its_row() -> None:
    listed = {flag for _, flag in ROWS.values()} - {""}
    assert listed == flags() - {"--config", "--show-config"}
    assert {"`--config", "`--show-config`"} <= set(TEXT.split())


def test_every_protocol_is_explained() -> None:
    assert set(re.findall(r"`([a-z-]+)/[A-Z:]+`", TEXT)) == set(PROTOCOLS)
