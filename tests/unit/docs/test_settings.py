"""The page about settings: it has every setting with its default, flag and variable, and nothing else."""

from __future__ import annotations

import re

import pytest
import typer

from tests.support.pages import DOCS
from zenoh_ice.application.cli import with_settings
from zenoh_ice.settings import PROTOCOLS, Security, Settings, load_settings

hooks = pytest.importorskip("docs.hooks", reason="needs the packages of visualhfsm[docs]")

TEXT = (DOCS / "reference/settings.md").read_text("utf-8")
WAYS = [
    (re.findall(r"`([^`]+)`", names), default.strip())
    for names, default in re.findall(r"^\| (`[^|]*) \|[^|]*\|([^|]*)\|", hooks.settings(), re.M)
]
ROWS = {
    names[0]: (
        default,
        next((name for name in names if name.startswith("--")), ""),
        next((name for name in names if name.startswith("VISUALHFSM_")), ""),
    )
    for names, default in WAYS
}
EXAMPLES = {
    "connect": "tcp/127.0.0.1:7",
    "listen": "tcp/127.0.0.1:7",
    "mode": "client",
    "clock": "wall",
    "local_sockets": "false",
    "log_level": "debug",
    "log_format": "json",
    "security.mutual": "false",
}
"""What a variable may be set to, where it may not be 7."""


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
        case tuple():
            shown = ", ".join(f"`{item}`" for item in value)
        case _:
            shown = f"`{value}`" if value else ""
    assert ROWS[name][0] == shown


def test_every_flag_has_its_row() -> None:
    listed = {flag for _, flag, _ in ROWS.values()} - {""}
    assert listed == flags() - {"--config", "--show-config"}
    assert {"`--config", "`--show-config`"} <= set(TEXT.split())


@pytest.mark.parametrize("name", [name for name in ROWS if ROWS[name][2]])
def test_the_variable_sets_it(name: str) -> None:
    text = EXAMPLES.get(name, "7")
    settings = load_settings(environment={ROWS[name][2]: text})
    assert settings.origins == {name: ROWS[name][2]}


def test_every_protocol_is_explained() -> None:
    assert set(re.findall(r"`([a-z-]+)/[A-Z:]+`", TEXT)) == set(PROTOCOLS)
