"""Hooks of MkDocs: pages at the root of the repository, decisions, links to sources, and generated tables.

`ARCHITECTURE.md`, `CHANGELOG.md` and `CONTRIBUTING.md` become pages of the site. A link to a file outside of
docs/ becomes its path. `<!-- generated: NAME -->` becomes what one of `GENERATED` returns, read off the code.
"""

from __future__ import annotations

import ast
import importlib
import inspect
import itertools
import logging
import posixpath
import re
import sys
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from types import UnionType
from typing import TYPE_CHECKING, Any, Final, get_args

import msgspec
import typer
from markdown.extensions.toc import slugify
from typer.core import TyperArgument, TyperGroup

from codegen.messages import Message
from tools.workspace import DISTRIBUTIONS, PLUG_INS, Distribution

if TYPE_CHECKING:  # tests use the tables alone: MkDocs takes long to load
    from mkdocs.config.defaults import MkDocsConfig
    from mkdocs.structure.files import Files
    from mkdocs.structure.pages import Page

ROOT: Final = Path(__file__).resolve().parents[1]
ROOT_PAGES: Final = {
    "ARCHITECTURE.md": "explanation/architecture.md",
    "CHANGELOG.md": "changelog.md",
    "CONTRIBUTING.md": "contributing.md",
}
COMMANDS: Final = {
    "visualhfsm": "visualhfsm._commands.app",
    "codegen": "codegen.command",
    "naoserver-sim": "naoserver_sim._command",
    "ballmover": "ballmover._cli",
    "nao": "nao_tools._command",
    **{
        name: f"{entry.partition('.__main__')[0]}._command"
        for each in PLUG_INS
        for name, entry in each.project.get("scripts", {}).items()
    },
}
PARTS: Final = {"codegen diff": "codegen._diff"}
"""Commands that are part of another one, each with its module."""
SHARED: Final = "Shared by all commands"  # the panel of zenoh_ice.application.cli
_MARKER: Final = re.compile(r"<!-- generated: ([a-z ]+) -->")
_APPROXIMATED: Final = re.compile(r"[Rr]emember|Do nothing|no effect|hear nothing|silent")
"""How the docstring of an operation says that it does less than a robot's."""
_REFUSED: Final = "Refused: "
"""How that of an operation begins that always fails."""
_FENCE: Final = re.compile(r"^(```\w+) .+$", re.M)
"""The opening of a code block with words for the tests after its language, such as `xml fragment`."""
_LINK: Final = re.compile(r"(!?)\[((?:`[^`]*`|[^\]`])*)\]\(([^)#\s]+)(#[^)]*)?\)")


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """List the decisions in the navigation below their index, in their order."""
    decisions: list[str | dict[str, str]] = ["decisions/README.md"]
    decisions += [
        {page.read_text("utf-8").split("\n", 1)[0].removeprefix("# "): f"decisions/{page.name}"}
        for page in sorted((ROOT / "docs" / "decisions").glob("0*.md"))
    ]
    for section in config.nav or []:
        if "Explanation" in section:
            next(entry for entry in section["Explanation"] if "Decisions" in entry)["Decisions"] = decisions
        if "Plug-ins" in section:
            section["Plug-ins"] = [
                {each.folder.name: [f"plugins/{each.folder.name}/{name.name}" for name in _pages(each)]}
                for each in PLUG_INS
            ]
    return config


def _pages(plug_in: Distribution) -> list[Path]:
    """Return its pages, by their names."""
    return sorted((plug_in.folder / "docs").glob("*.md"))


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages of the root and of plug-ins."""
    from mkdocs.structure.files import File

    for name, page in ROOT_PAGES.items():
        text = (ROOT / name).read_text("utf-8")
        files.append(File.generated(config, page, content=_relink(text, "", page)))
    for plug_in in PLUG_INS:
        for path in _pages(plug_in):
            page = f"plugins/{plug_in.folder.name}/{path.name}"
            folder = path.parent.relative_to(ROOT).as_posix()
            text = _relink(path.read_text("utf-8"), folder, page)
            files.append(File.generated(config, page, content=text))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:  # noqa: ARG001
    """Turn links out of docs/ into pages of the site or into paths, and write what is generated."""
    if page.file.generated_by is None:
        markdown = _relink(markdown, posixpath.dirname(f"docs/{page.file.src_uri}"), page.file.src_uri)
    markdown = _FENCE.sub(
        r"\1", markdown
    )  # MkDocs knows no other words there, and takes the block's end for its start
    return _MARKER.sub(lambda match: GENERATED[match[1]](), markdown)


def _relink(text: str, folder: str, page: str) -> str:
    """Return a text with its links, which start in a folder of the repository, as links from a page."""

    def replace(match: re.Match[str]) -> str:
        image, label, link, anchor = match[1], match[2], match[3], match[4] or ""
        if ":" in link:
            return match[0]
        target = posixpath.normpath(posixpath.join(folder, link))
        inside = ROOT_PAGES.get(target) or (target[5:] if target.startswith("docs/") else _of_plug_in(target))
        if inside is None:
            return label if f"`{target}`" == label else f"{label} (`{target}`)"
        return f"{image}[{label}]({posixpath.relpath(inside, posixpath.dirname(page) or '.')}{anchor})"

    return _LINK.sub(replace, text)


def _of_plug_in(target: str) -> str | None:
    """Return the page of the site that a page of a plug-in becomes, if it is there."""
    found = re.fullmatch(r"(plugins/\w+/)docs/([\w-]+\.md)", target)
    return found[1] + found[2] if found and (ROOT / target).exists() else None


def commands() -> str:
    """Return the help of every command."""
    return "\n\n".join(
        _with_libqi(partial(_help, name, module), f"`{name}`")
        for name, module in sorted(
            {**COMMANDS, **PARTS}.items(), key=lambda item: [*COMMANDS].index(item[0].split()[0])
        )
    )


def _help(name: str, module: str) -> str:
    return _command(name, typer.main.get_command(importlib.import_module(module).app))


def _with_libqi(text: Callable[[], str], what: str) -> str:
    """Return a text that is made from code on libqi, or that this Python has no libqi."""
    try:
        return text()
    except ModuleNotFoundError as error:
        if error.name != "qi":
            raise
    version = ".".join(map(str, sys.version_info[:2]))
    logging.getLogger("mkdocs").info("%s is left out: libqi has no package for Python %s", what, version)
    return f"{what}: not shown here, as libqi has no package for the Python of this build, {version}."


def component() -> str:
    """Return a table of the options that every generated component has beside the shared ones."""
    from hfsm_runtime import Component
    from hfsm_runtime.command import make_app

    return _options(typer.main.get_command(make_app(Component)))


def _command(name: str, command: Any, level: int = 2) -> str:  # noqa: ANN401 - typer hides the types of its commands
    text = (command.help or "").split("\f")[0].replace("\b", "").strip()
    parts = [f"{'#' * level} {name}", text.replace("<", "&lt;")]
    parts.append(_options(command))
    if isinstance(command, TyperGroup):
        visible = {key: each for key, each in command.commands.items() if not each.hidden}
        parts += [_command(f"{name} {key}", each, level + 1) for key, each in visible.items()]
    return "\n\n".join(filter(None, parts))


def _options(command: Any) -> str:  # noqa: ANN401
    own = [each for each in command.params if getattr(each, "rich_help_panel", None) != SHARED]
    rows = [_row(parameter) for parameter in own if not getattr(parameter, "hidden", False)]
    return _table(("option", "meaning"), rows) if rows else ""


def _row(parameter: Any) -> tuple[str, str]:  # noqa: ANN401
    names = ", ".join([*parameter.opts, *parameter.secondary_opts])
    if isinstance(parameter, TyperArgument):
        names = (parameter.metavar or parameter.name or "").upper()
    meaning = " ".join((getattr(parameter, "help", None) or "").split())
    return f"`{names}`", _plain(meaning)


def settings() -> str:
    """Return a table of all settings, each with its flag and its variable of the environment."""
    from zenoh_ice.settings import ENVIRONMENT_PREFIX, PATHS, Security, Settings

    flags = set(shared_options())
    rows = []
    for kind, prefix in ((Settings, ""), (Security, "security.")):
        meanings = _docstrings(kind)
        for field in _info(kind).fields:
            name, flag = prefix + field.name, f"--{field.name.replace('_', '-')}"
            if name == "security":
                continue
            ways = [name]
            if flag in flags and (not prefix or field.name in PATHS):
                ways.append(flag)
            if _type(field.type) != "table":
                ways.append(ENVIRONMENT_PREFIX + name.upper().replace(".", "_"))
            names = "<br>".join(f"`{way}`" for way in ways)
            rows.append((names, _type(field.type), _default(field), meanings[field.name]))
    return _table(("setting, flag, variable", "type", "default", "meaning"), rows)


def roles() -> str:
    """Return a table of what a role in the settings has."""
    from zenoh_ice.settings import Role

    meanings = _docstrings(Role)
    rows = [
        (f"`{field.name}`", _type(field.type), _default(field), meanings[field.name])
        for field in _info(Role).fields
    ]
    return _table(("key", "type", "default", "meaning"), rows)


def shared_options() -> Iterator[str]:
    """Yield the options that all commands share."""
    command: Any = typer.main.get_command(importlib.import_module("ballmover._cli").app)
    for parameter in command.params:
        if getattr(parameter, "rich_help_panel", None) == SHARED:
            yield from parameter.opts


def exceptions() -> str:
    """Return a list of the public exceptions of each package, each below the one that it extends."""
    parts = []
    for package in (path for each in DISTRIBUTIONS for path in each.packages):
        found = [node for path in sorted(package.rglob("*.py")) for node in _exceptions(path)]
        if not found:
            continue
        names = {node.name for node in found}
        below: dict[str, list[ast.ClassDef]] = {}
        for node in found:
            base = next((name for name in map(ast.unparse, node.bases) if name in names), "")
            below.setdefault(base, []).append(node)
        parts.append("\n".join([f"### {package.name}\n", *_tree(below, "", 0)]))
    return "\n\n".join(parts)


def _exceptions(path: Path) -> Iterator[ast.ClassDef]:
    text = path.read_text("utf-8")
    if not re.search(r"^class \w+\([^)]*(Error|Exception|InvalidCommand)\b", text, re.MULTILINE):
        return  # as most files: parsing takes long
    for node in ast.parse(text).body:
        if not isinstance(node, ast.ClassDef) or node.name.startswith("_"):
            continue
        if any(re.search(r"(Error|Exception|InvalidCommand)$", ast.unparse(base)) for base in node.bases):
            yield node


def _tree(below: dict[str, list[ast.ClassDef]], parent: str, depth: int) -> Iterator[str]:
    for node in below.get(parent, []):
        others = [base for base in map(ast.unparse, node.bases) if base != parent]
        bases = f" ({', '.join(f'`{base}`' for base in others)})" if others else ""
        yield f"{'    ' * depth}- `{node.name}`{bases}: {_plain(ast.get_docstring(node) or '')}"
        yield from _tree(below, node.name, depth + 1)


def diagnostics() -> str:
    """Return a table of the codes of all diagnostics, each with its page."""
    from codegen._idl.report import Code as InterfaceCode
    from codegen.hfsm.codes import Code as DocumentCode

    headings = {}
    for page in ("document-errors.md", "idl-errors.md"):
        for title in re.findall(
            r"^## (.*)$", (ROOT / "docs/reference" / page).read_text("utf-8"), re.MULTILINE
        ):
            code, _, meaning = title.partition(": ")
            headings[code] = (meaning, f"{page}#{slugify(title, '-')}")
    rows = []
    for code in [*InterfaceCode, *DocumentCode]:
        plain = code.name.lower().replace("_", " ")
        meaning, link = headings.get(code.value, (plain, "../explanation/model-checker.md"))
        rows.append((f"[{code.value}]({link})", _plain(meaning)))
    return _table(("code", "about"), rows)


def requests() -> str:
    """Return a table of the requests of the editor's page, with their answers."""
    from visualhfsm._editor import protocol

    return _messages(get_args(protocol.Request), answered=True)


def pushes() -> str:
    """Return a table of what the editor's server sends by itself."""
    from visualhfsm._editor import protocol
    from visualhfsm._monitor import messages as services
    from visualhfsm._processes import test_results as tests

    modules = [protocol, services, tests]
    if find_spec("visualhfsm_trials"):
        modules.append(importlib.import_module("visualhfsm_trials._messages"))
    kinds = [each for module in modules for each in vars(module).values() if _is(each, services.Push)]
    return _messages([each for each in dict.fromkeys(kinds) if each is not services.Push])


def edits() -> str:
    """Return a table of the commands that change a document."""
    from visualhfsm._document.commands import COMMANDS as EDITS

    return _messages(EDITS)


def naoqi() -> str:
    """Return a table of the operations of NAOqi's services on the virtual Nao."""
    return _with_libqi(_naoqi_operations, "The table of NAOqi's operations")


def _naoqi_operations() -> str:
    from visualhfsm_naoqi.programs import _service as service

    rows = []
    for name in sorted({*service.SERVICES, *service.REFUSED}):
        if refused := service.REFUSED.get(name):
            rows += [(f"`{name}.{each}`", "refused", refused.reason) for each in sorted(refused.operations)]
            rows += [
                (f"`{name}.{each}`", "approximated", f"It is off: {refused.reason}.") for each in refused.off
            ]
        functions = {
            k: v
            for part in service.SERVICES.get(name, ())
            for k, v in inspect.getmembers(part, inspect.isfunction)
        }
        for operation, function in sorted(functions.items()):
            if not operation.startswith("_"):
                does = (inspect.getdoc(function) or "").partition("\n\n")[0]
                kind = "approximated" if _APPROXIMATED.search(does) else "works"
                if does.startswith(_REFUSED):
                    kind, does = "refused", does.removeprefix(_REFUSED)
                rows.append((f"`{name}.{operation}`", kind, _plain(does)))
    return _table(("operation", "", "what it does"), rows)


def _is(found: object, base: type) -> bool:
    return isinstance(found, type) and issubclass(found, base)


def _messages(kinds: Iterable[type], *, answered: bool = False) -> str:
    rows = []
    for kind in kinds:
        info = _info(kind)
        fields = [field for field in info.fields if field.name != "id" or not answered]
        answer = (_answer(getattr(kind, "answer")),) if answered else ()  # noqa: B009 - of requests alone
        rows.append((f"`{info.tag}`", _fields(fields), *answer, _plain(inspect.getdoc(kind) or "")))
    return _table(("name", "fields", *(("answer",) if answered else ()), "meaning"), rows)


def _fields(fields: Iterable[msgspec.inspect.Field]) -> str:
    return "<br>".join(
        f"`{field.encode_name}`{'' if field.required else '?'}: {_type(field.type)}" for field in fields
    )


def _answer(kind: Any) -> str:  # noqa: ANN401 - the type of an answer
    """Return the fields of an answer, or what it is."""
    if isinstance(kind, UnionType):
        return "<br>or ".join(map(_answer, get_args(kind)))
    info = msgspec.inspect.type_info(kind)
    item = info.item_type if isinstance(info, msgspec.inspect.ListType) else info
    fields = getattr(item, "fields", None)
    if fields is None:
        return _type(info)
    return f"{'list:<br>' if item is not info else ''}{_fields(fields)}"


def _info(kind: type) -> msgspec.inspect.StructType:
    info = msgspec.inspect.type_info(kind)
    assert isinstance(info, msgspec.inspect.StructType)
    return info


def _docstrings(kind: type) -> dict[str, str]:
    """Return the docstrings of a struct's fields."""
    body = ast.parse(inspect.getsource(kind)).body[0]
    assert isinstance(body, ast.ClassDef)
    return {
        ast.unparse(node.target): _plain(ast.literal_eval(following.value))
        for node, following in itertools.pairwise(body.body)
        if isinstance(node, ast.AnnAssign) and isinstance(following, ast.Expr)
    }


def _type(kind: Any) -> str:  # noqa: ANN401 - one of the many types of msgspec.inspect
    """Return what may be written, in words of TOML and JSON."""
    types = msgspec.inspect
    match kind:
        case types.Metadata():
            return _type(kind.type)
        case types.LiteralType():
            return ", ".join(f"`{value}`" for value in kind.values)
        case types.IntType() | types.FloatType():
            word = "integer" if isinstance(kind, types.IntType) else "number"
            bounds = kind.ge is not None and kind.le is not None and abs(kind.le) < 2**30
            return f"{word}, {kind.ge:g} to {kind.le:g}" if bounds else word
        case types.BoolType():
            return "true, false"
        case types.StrType():
            return "text"
        case types.BytesType():
            return "base64"
        case types.CustomType(cls=kind) if kind is Message:
            return "text"
        case types.VarTupleType() | types.ListType() | types.CollectionType():
            return f"list: {_type(kind.item_type)}"
        case types.DictType() | types.StructType() | types.TypedDictType() | types.DataclassType():
            return "table"
        case types.UnionType():
            return " or ".join(dict.fromkeys(map(_type, kind.types)))
        case types.NoneType():
            return "null"
    return "any"


def _default(field: msgspec.inspect.Field) -> str:
    value = field.default
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple):
        return ", ".join(f"`{each}`" for each in value)
    return f"`{value}`" if isinstance(value, int | float | str) and value != "" else ""


def _plain(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|").replace("<", "&lt;")


def _table(heads: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    lines = [heads, tuple("---" for _ in heads), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


GENERATED: Final[dict[str, Callable[[], str]]] = {
    made.__name__: made
    for made in (
        commands,
        component,
        diagnostics,
        edits,
        exceptions,
        naoqi,
        pushes,
        requests,
        roles,
        settings,
    )
}
"""What a page names in `<!-- generated: NAME -->`."""
