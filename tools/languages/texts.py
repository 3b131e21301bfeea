"""Bring the catalogs of all languages up to date with the code: `make texts`, or `make texts NEW=fr`.

A language is a folder with one gettext catalog for each domain: `page` has the texts of the editor's page,
`messages` what Python says there, `sentences` what robots and components say over the network.
Each run extracts the texts of the code, adds new ones to each catalog, removes those that the code no longer
has, and writes what is read at run time. `NEW` adds a language.
"""

from __future__ import annotations

import argparse
import ast
import io
import json
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from gettext import GNUTranslations
from pathlib import Path
from typing import Any, Final

from babel import Locale, UnknownLocaleError
from babel.messages.catalog import Catalog, Message
from babel.messages.extract import extract
from babel.messages.mofile import write_mo
from babel.messages.pofile import PoFileError, read_po, write_po

from codegen.diagnostics import Diagnostics
from codegen.hfsm import read_document
from tools.workspace import PLUG_INS

ROOT: Final = Path(__file__).resolve().parents[2]
LANGUAGES: Final = ROOT / "visualhfsm" / "_base" / "languages"
STATIC: Final = ROOT / "visualhfsm" / "_editor" / "static"
SHELF: Final = ROOT / "shelf"

_WIDTH: Final = 110
_LIMIT: Final = 60  # s for Node.js
_UNSAID: Final = tuple(
    f'"{name}:'.encode()
    for name in (
        *("Generated-By", "Language-Team", "Last-Translator", "PO-Revision-Date", "POT-Creation-Date"),
        *("Project-Id-Version", "Report-Msgid-Bugs-To"),
    )
)
"""Fields of a catalog that would change with each run, or that Git knows better."""
_SAMPLES: Final = (*range(1000), 1_000_000)
"""Numbers with which the rules of a catalog are compared with CLDR's, which browsers use."""


class TextsError(Exception):
    """The catalogs cannot be brought up to date."""


_PLUG_INS: Final = tuple(f"plugins/{each.folder.name}/src" for each in PLUG_INS)
_CODE: Final = ("codegen", *_PLUG_INS, "visualhfsm")
_ROBOTS: Final = ("naoserver/", "naoserver_sim/", "plugins/naoqi/src/visualhfsm_naoqi/robot/")
_REFUSALS: Final = {
    **dict.fromkeys(("CommandRefused", "InvalidValueException", "LinkLost", "RouteError"), 0),
    "InvalidCommand": 1,
    "JointTaken": 2,
}
"""Errors of robots that a page shows: the place of their text among the arguments."""
_SPEAKERS: Final = ("hfsm_runtime", "naoserver", "naoserver_sim", *_PLUG_INS, "visualhfsm", "zenoh_ice")
_OF_COMMANDS: Final = (
    *("codegen/_idl", "plugins/classes/src/visualhfsm_classes", "visualhfsm/_base/html_file.py"),
    *(
        f"visualhfsm/_commands/{name}.py"
        for name in ("convert", "document", "draw", "new", "report", "steer")
    ),
    *("visualhfsm/_monitor/replay.py", "visualhfsm/_monitor/target.py", "visualhfsm/_editor/site.py"),
    *(f"plugins/agent/src/visualhfsm_agent/_{name}.py" for name in ("approval", "code", "desk", "limits")),
    *(
        "plugins/trials/src/visualhfsm_cluster",
        "visualhfsm/trials/_comparison.py",
        "visualhfsm/trials/_runners.py",
    ),
)
"""What speaks to terminals and agents alone, in English."""
_FOR_PUPILS: Final = "plugins/classes/src/visualhfsm_classes/_words.py"
"""What commands say in all languages."""
_KEYWORDS: Final[Sequence[Mapping[str, tuple[int, ...]]]] = (
    {"Message": (1,), "counted": (1, 2), "template": (1,), "because": (1,), "in_place_of": (2,)},
    *(dict.fromkeys(("EditError", "ChangedOutsideError", "OldFormatError"), (text,)) for text in (1, 2, 3)),
)
"""The arguments of `codegen.messages`, and of errors, that are texts; several of one call are no plural."""


def message_texts() -> Catalog:
    """Return the texts of Python that may reach a page."""
    catalog = Catalog()
    paths = sorted(path for folder in _CODE for path in (ROOT / folder).rglob("*.py"))
    for path in paths:
        name = path.relative_to(ROOT).as_posix()
        if name.startswith(_OF_COMMANDS) and name != _FOR_PUPILS:
            continue
        code = path.read_bytes()
        found = [
            each
            for keywords in _KEYWORDS
            if any(word.encode() in code for word in keywords)  # to look closely takes long
            for each in extract("python", io.BytesIO(code), keywords, ["Translators:"])
        ]
        for _, texts, comments, _ in sorted(found, key=lambda each: each[0]):
            catalog.add(texts, locations=[(name, 1)], auto_comments=comments)
    for message in catalog:
        message.flags -= {"python-format", "python-brace-format"}
    return catalog


def sentence_texts() -> Catalog:
    """Return the templates of English texts that a page may hear from robots and components."""
    catalog = Catalog()
    for path in sorted(path for folder in _SPEAKERS for path in (ROOT / folder).rglob("*.py")):
        name, code = path.relative_to(ROOT).as_posix(), path.read_bytes()
        if b"sentence" not in code and not name.startswith(_ROBOTS):
            continue
        for call in ast.walk(ast.parse(code)):
            if isinstance(call, ast.Call) and (text := _sentence_in(call, name)) is not None:
                catalog.add(template_of(text, f"{name}:{call.lineno}"), locations=[(name, 1)])
    for message in catalog:
        message.flags -= {"python-format", "python-brace-format"}
    return catalog


def _sentence_in(call: ast.Call, name: str) -> ast.expr | None:
    """Return the argument of a call in a file that is a sentence; None if none is."""
    called = ast.unparse(call.func).rpartition(".")[2]
    if called == "sentence":
        return call.args[0]
    place = _REFUSALS.get(called, len(call.args)) if name.startswith(_ROBOTS) else len(call.args)
    text = next(iter(call.args[place:]), None)
    return text if isinstance(text, ast.JoinedStr | ast.Constant) else None


def template_of(text: ast.expr, place: str) -> str:
    """Return a literal or an f-string as a template of `str.format`, whose values have names.

    Raises TextsError for any other code, and for two values of one name.
    """
    match text:
        case ast.Constant(value=str(literal)):
            return literal.replace("{", "{{").replace("}", "}}")
        case ast.JoinedStr(values=pieces):
            template, values = "", dict[str, str]()
            for each in pieces:
                if not isinstance(each, ast.FormattedValue):
                    template += template_of(each, place)
                    continue
                name, code = _name_of(each.value, place), ast.unparse(each.value)
                if values.setdefault(name, code) != code:
                    raise TextsError(f"{place}: two values are called {name}: rename one")
                template += f"{{{name}}}"
            return template
    raise TextsError(f"{place}: a sentence is a literal or an f-string")


def _name_of(value: ast.expr, place: str) -> str:
    """Return the last name in an expression, or in its first argument; for a `name`, that of its owner."""
    match value:
        case ast.Attribute(value=owner, attr="name" | "__name__") if ast.unparse(owner) != "self":
            return _name_of(owner, place)
        case ast.Name(id=name) | ast.Attribute(attr=name):
            return name.strip("_").lower()
        case ast.Call(args=[first, *_]) | ast.Subscript(value=first) | ast.BoolOp(values=[first, *_]):
            return _name_of(first, place)
    raise TextsError(f"{place}: a value without a name: {ast.unparse(value)}")


def message_mo(catalog: Catalog) -> bytes:
    """Return a catalog as gettext reads it, the same on each day and with each Babel."""
    bare = _Bare(catalog.locale)
    for message in catalog:
        if message.id and is_translated(message):
            bare.add(message.id, message.string)
    file = io.BytesIO()
    write_mo(file, bare)
    return file.getvalue()


class _Bare(Catalog):
    """A catalog whose head has what gettext needs, and neither a date nor a version."""

    @property
    def mime_headers(self) -> list[tuple[str, str]]:
        return [("Content-Type", "text/plain; charset=utf-8"), ("Plural-Forms", self.plural_forms)]


def page_texts() -> Catalog:
    """Return the texts of the page, and of the ready states that it shows.

    Raises TextsError when Node.js is not installed, or a text is no constant.
    """
    command = ["node", str(ROOT / "tests" / "page" / "page-texts.js")]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=_LIMIT, check=True)
    except FileNotFoundError as error:
        raise TextsError(
            "the texts of the page are found with Node.js: install it, then run npm ci"
        ) from error
    except subprocess.CalledProcessError as error:
        raise TextsError(error.stderr.strip()) from error
    catalog = Catalog()
    for each in json.loads(done.stdout)["messages"]:
        names = (each["id"], each["plural"]) if "plural" in each else each["id"]
        comments = [each["comment"]] if "comment" in each else []
        catalog.add(names, locations=[(each["file"], 1)], flags=[], auto_comments=comments)
    for place, text in _shelf_texts():
        catalog.add(text, locations=[(place, 1)], flags=[])
    for message in catalog:
        message.flags.discard("python-format")
    return catalog


def _shelf_texts() -> Iterator[tuple[str, str]]:
    """Yield what the page shows of the ready states that come along, each text with the file that has it."""
    for path in sorted(SHELF.glob("*.xml")):
        document = read_document(path, Diagnostics())
        if document is None or document.shelf is None:
            raise TextsError(f"{path} cannot be read: visualhfsm check {path}")
        place = path.relative_to(ROOT).as_posix()
        shown = [document.description, document.shelf.title, document.shelf.category, document.shelf.words]
        for root in document.automata[:1]:
            shown += [each.description for each in (*root.inputs, *root.outputs)]
        yield from ((place, text) for each in shown if (text := " ".join(each.text.split())))


def texts_json(catalog: Catalog) -> bytes:
    """Return a catalog as the page and its server read it: texts by those of the code.

    A text with a number is an object of texts by the categories of `Intl.PluralRules`. The empty text, which
    the code never has, says what the file is. Raises TextsError when the rules of the catalog are not those
    of CLDR.
    """
    forms = forms_by_category(catalog)
    texts: dict[str, Any] = {
        "": f"Written by `make texts` from {catalog.locale}/{catalog.domain}.po. Do not edit."
    }
    for message in catalog:
        if not message.id or not message.string or not is_translated(message):
            continue
        if isinstance(message.id, str):
            texts[message.id] = message.string
        else:
            texts[message.id[0]] = {category: message.string[form] for category, form in forms.items()}
    return (json.dumps(texts, ensure_ascii=False, indent=0, sort_keys=True) + "\n").encode()


def forms_by_category(catalog: Catalog) -> dict[str, int]:
    """Return the index of the catalog's form for each category of CLDR.

    Raises TextsError when a category would have several.
    """
    locale = Locale.parse(str(catalog.locale))
    found: dict[str, int] = {}
    form = _form_of(catalog)
    for number in _SAMPLES:
        category = locale.plural_form(number)
        if found.setdefault(category, form(number)) != form(number):
            raise TextsError(
                f"{catalog.locale}: {catalog.plural_expr} has other forms than CLDR for {category}, such as "
                f"for {number}"
            )
    # Numbers with decimals have separate categories in some languages: the last form is for all others.
    return {**dict.fromkeys(("other", *locale.plural_form.tags), catalog.num_plurals - 1), **found}


def _form_of(catalog: Catalog) -> Callable[[int], int]:
    """Return the rule of a catalog, as gettext evaluates it."""
    rule = Catalog(locale=catalog.locale)
    rule.mime_headers = [
        ("Plural-Forms", catalog.plural_forms),
        ("Content-Type", "text/plain; charset=utf-8"),
    ]
    rule.add(("one", "other"), [str(form) for form in range(catalog.num_plurals)])
    file = io.BytesIO()
    write_mo(file, rule)
    file.seek(0)
    translations = GNUTranslations(file)
    return lambda number: int(translations.ngettext("one", "other", number))


def is_translated(message: Message) -> bool:
    """Whether a message of a catalog has all its texts."""
    texts = (message.string,) if isinstance(message.string, str) else message.string or ()
    return bool(texts) and all(texts) and not message.fuzzy


@dataclass(frozen=True, slots=True)
class Domain:
    """What is translated in one catalog: `extract` finds its texts, `compile` makes what is read at run time.

    `compiled` is the path of that, relative to the repository, for a language.
    """

    name: str
    extract: Callable[[], Catalog]
    compile: Callable[[Catalog], bytes]
    compiled: str

    def catalog_of(self, language: str, folder: Path = LANGUAGES) -> Catalog:
        """Return a catalog as it is on disk. Raises TextsError when it is no catalog."""
        path = folder / language / f"{self.name}.po"
        try:
            content = io.BytesIO(path.read_bytes())
            return read_po(content, locale=_locale(language), domain=self.name, abort_invalid=True)
        except (OSError, PoFileError, ValueError) as error:
            raise TextsError(f"{path}: {error}") from error


DOMAINS: Final = (
    Domain("page", page_texts, texts_json, "visualhfsm/_editor/static/languages/{language}.json"),
    Domain("messages", message_texts, message_mo, "visualhfsm/_base/languages/{language}/messages.mo"),
    Domain("sentences", sentence_texts, texts_json, "visualhfsm/_base/languages/{language}/sentences.json"),
)


def updated(catalog: Catalog, texts: Catalog) -> bytes:
    """Return a catalog with exactly the texts of the code, as a file; translations of these are kept.

    A checkout may lack the folder of a plug-in: what the catalog has from there stays.
    """
    for message in catalog:
        absent = [(file, 1) for file, _ in message.locations if _is_of_absent_plug_in(file)]
        if message.id and absent:
            texts.add(message.id, locations=absent, flags=message.flags)
    catalog.update(texts, no_fuzzy_matching=True, update_creation_date=False)
    file = io.BytesIO()
    write_po(file, catalog, width=_WIDTH, sort_output=True, ignore_obsolete=True, include_lineno=False)
    return b"".join(
        line for line in file.getvalue().splitlines(keepends=True) if not line.startswith(_UNSAID)
    )


def _is_of_absent_plug_in(file: str) -> bool:
    return file.startswith("plugins/") and not (ROOT / Path(*Path(file).parts[:2])).exists()


def added(domain: Domain, language: str) -> Catalog:
    """Return an empty catalog for a language. Raises TextsError when CLDR does not know the language."""
    locale = _locale(language)
    name = Locale.parse(locale).english_name
    comment = f"# {name} texts of VisualHFSM. Terms: docs/how-to/translate.md"
    return Catalog(locale, domain.name, comment, fuzzy=False)


def _locale(language: str) -> str:
    name = language.replace("-", "_")
    try:
        Locale.parse(name)
    except (ValueError, UnknownLocaleError) as error:
        raise TextsError(f"{language!r} is no language of CLDR: write it such as fr or pt-BR") from error
    return name


def languages(folder: Path = LANGUAGES) -> list[str]:
    """Return the languages that there are catalogs for."""
    return sorted(path.name for path in folder.iterdir() if any(path.glob("*.po")))


def update(root: Path, new: str | None, domains: Sequence[Domain] = DOMAINS) -> Mapping[str, int]:
    """Update all catalogs below a folder like the repository.

    Returns how many texts each language lacks. Raises TextsError.
    """
    folder = root / LANGUAGES.relative_to(ROOT)
    names = sorted({*languages(folder), *([new] if new else [])})
    missing = dict.fromkeys(names, 0)
    for domain in domains:
        texts = domain.extract()
        for language in names:
            path = folder / language / f"{domain.name}.po"
            catalog = domain.catalog_of(language, folder) if path.exists() else added(domain, language)
            path.parent.mkdir(exist_ok=True)
            path.write_bytes(updated(catalog, texts))
            catalog = domain.catalog_of(language, folder)
            compiled = root / domain.compiled.format(language=language)
            compiled.parent.mkdir(parents=True, exist_ok=True)
            compiled.write_bytes(domain.compile(catalog))
            missing[language] += sum(bool(each.id) and not is_translated(each) for each in catalog)
    return missing


def main() -> int:
    """Update the catalogs of the repository."""
    parser = argparse.ArgumentParser(
        description="Bring the catalogs of all languages up to date with the code."
    )
    parser.add_argument("--new", metavar="LANGUAGE", help="add a language, such as fr or pt-BR")
    try:
        missing = update(ROOT, parser.parse_args().new)
    except TextsError as error:
        sys.stderr.write(f"{error}\n")
        return 1
    for language, count in missing.items():
        sys.stdout.write(f"{language}: {f'{count} texts are not translated' if count else 'complete'}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
