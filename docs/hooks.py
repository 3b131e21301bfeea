"""Hooks of MkDocs: pages at the root of the repository, decisions, links to sources, and commands.

`ARCHITECTURE.md`, `CHANGELOG.md` and `CONTRIBUTING.md` become pages of the site. A link to a file outside of
docs/ becomes its path. `<!-- commands -->` becomes the help of every command.
"""

from __future__ import annotations

import importlib
import posixpath
import re
from pathlib import Path
from typing import Any, Final

import typer
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page
from typer.core import TyperArgument, TyperGroup

ROOT: Final = Path(__file__).resolve().parents[1]
ROOT_PAGES: Final = {
    "ARCHITECTURE.md": "explanation/architecture.md",
    "CHANGELOG.md": "changelog.md",
    "CONTRIBUTING.md": "contributing.md",
}
COMMANDS: Final = {
    "visualhfsm": "visualhfsm.command",
    "codegen": "codegen.command",
    "naoserver-sim": "naoserver_sim.command",
    "ballmover": "ballmover.cli",
    "nao": "deploy.nao.command",
}
SHARED: Final = "Shared by all commands"  # the panel of hfsm_command.cli
_LINK: Final = re.compile(r"(!?)\[([^\]]*)\]\(([^)#\s]+)(#[^)]*)?\)")


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """List the decisions in the navigation, in their order."""
    decisions = [
        {page.read_text("utf-8").split("\n", 1)[0].removeprefix("# "): f"decisions/{page.name}"}
        for page in sorted((ROOT / "docs" / "decisions").glob("*.md"))
    ]
    for section in config.nav or []:
        if "Explanation" in section:
            next(entry for entry in section["Explanation"] if "Decisions" in entry)["Decisions"] = decisions
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages of the root."""
    for name, page in ROOT_PAGES.items():
        text = (ROOT / name).read_text("utf-8")
        files.append(File.generated(config, page, content=_relink(text, "", page)))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:  # noqa: ARG001
    """Turn links out of docs/ into pages of the site or into paths, and write the commands."""
    if page.file.generated_by is None:
        markdown = _relink(markdown, posixpath.dirname(f"docs/{page.file.src_uri}"), page.file.src_uri)
    return markdown.replace("<!-- commands -->", commands() if "<!-- commands -->" in markdown else "")


def _relink(text: str, folder: str, page: str) -> str:
    """Return a text with its links, which start in a folder of the repository, as links from a page."""

    def replace(match: re.Match[str]) -> str:
        image, label, link, anchor = match[1], match[2], match[3], match[4] or ""
        if ":" in link:
            return match[0]
        target = posixpath.normpath(posixpath.join(folder, link))
        inside = ROOT_PAGES.get(target) or (target[5:] if target.startswith("docs/") else None)
        if inside is None:
            return label if f"`{target}`" == label else f"{label} (`{target}`)"
        return f"{image}[{label}]({posixpath.relpath(inside, posixpath.dirname(page) or '.')}{anchor})"

    return _LINK.sub(replace, text)


def commands() -> str:
    """Return what every command does and takes, as Markdown."""
    return "\n\n".join(
        _command(name, typer.main.get_command(importlib.import_module(module).app))
        for name, module in COMMANDS.items()
    )


def _command(name: str, command: Any, level: int = 2) -> str:  # noqa: ANN401 - typer hides the types of its commands
    text = (command.help or "").split("\f")[0].replace("\b", "").strip()
    parts = [f"{'#' * level} {name}", text.replace("<", "&lt;")]
    own = [each for each in command.params if getattr(each, "rich_help_panel", None) != SHARED]
    rows = [_row(parameter) for parameter in own if not getattr(parameter, "hidden", False)]
    if rows:
        parts.append("\n".join(["| option | meaning |", "|---|---|", *rows]))
    if isinstance(command, TyperGroup):
        visible = {key: each for key, each in command.commands.items() if not each.hidden}
        parts += [_command(f"{name} {key}", each, level + 1) for key, each in visible.items()]
    return "\n\n".join(filter(None, parts))


def _row(parameter: Any) -> str:  # noqa: ANN401
    names = ", ".join([*parameter.opts, *parameter.secondary_opts])
    if isinstance(parameter, TyperArgument):
        names = (parameter.metavar or parameter.name).upper()
    meaning = " ".join((getattr(parameter, "help", None) or "").split())
    return f"| `{names}` | {meaning.replace('|', chr(92) + '|').replace('<', '&lt;')} |"
