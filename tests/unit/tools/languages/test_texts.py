"""The catalogs of all languages: complete, up to date, and of one mind with browsers about plurals."""

from __future__ import annotations

import ast
import json
import re
import shutil
import subprocess
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from babel.messages.catalog import Catalog

from tests.support.limits import RUN_LIMIT
from tests.support.plugins import OF_THE_WHOLE
from tools.languages.texts import (
    DOMAINS,
    LANGUAGES,
    ROOT,
    STATIC,
    Domain,
    TextsError,
    added,
    forms_by_category,
    is_translated,
    languages,
    template_of,
    texts_json,
    update,
    updated,
)
from visualhfsm._editor.assets import Assets

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(shutil.which("node") is None, reason="Node.js is not installed"),
]

PLACEHOLDER = re.compile(r"{(\w[^{}]*)}")
ALL = [
    pytest.param(domain, language, id=f"{language}-{domain.name}")
    for domain in DOMAINS
    for language in languages()
]
PLURALS = [*languages(), "ar", "fr", "ga", "ja", "pl", "pt-BR", "ru"]
"""Languages with few and many plural forms."""


@pytest.fixture(scope="module")
def extracted() -> Callable[[Domain], Catalog]:
    """The texts of the code, found once for each domain."""
    known: dict[str, Catalog] = {}

    def texts(domain: Domain) -> Catalog:
        if domain.name not in known:
            known[domain.name] = domain.extract()
        return known[domain.name]

    return texts


@pytest.fixture
def domains(extracted: Callable[[Domain], Catalog]) -> list[Domain]:
    """The domains, whose texts have been found already."""
    return [replace(domain, extract=partial(extracted, domain)) for domain in DOMAINS]


def texts_of(names: str | Sequence[str] | None) -> Sequence[str]:
    return [names] if isinstance(names, str) else names or []


def ids(catalog: Catalog) -> set[Any]:
    return {message.id for message in catalog if message.id}


def called(call: ast.Call) -> str:
    """Return the last name of what is called."""
    return next((str(name) for each in ("attr", "id") if (name := getattr(call.func, each, ""))), "")


def test_no_text_that_is_looked_up_is_put_together() -> None:
    names = {"Message", "because", "template", "EditError", "ChangedOutsideError", "OldFormatError"}
    paths = [
        path
        for folder in (ROOT / "codegen", ROOT / "visualhfsm", *ROOT.glob("plugins/*/src"))
        for path in folder.rglob("*.py")
    ]
    found = [
        f"{path.relative_to(ROOT)}:{call.lineno}"
        for path in paths
        for call in ast.walk(ast.parse(path.read_bytes()))
        if isinstance(call, ast.Call) and called(call) in names
        if any(isinstance(text, ast.JoinedStr | ast.BinOp) for text in call.args)
    ]
    assert len(paths) > 300
    assert found == []


@pytest.mark.parametrize(
    ("code", "template"),
    [
        ('"it has fallen"', "it has fallen"),
        ('"a set is {}"', "a set is {{}}"),
        ('f"{joint} is limp" "; {joint}"', "{joint} is limp; {{joint}}"),
        ('f"{self._walker.ended}: {_MOST}"', "{ended}: {most}"),
        ('f"{value:.2f} of {few(names, 8)!r} in {values[0]}"', "{value} of {names} in {values}"),
        (
            'f"{actor.automaton.name} in {actor.current.name} of {self.name}"',
            "{automaton} in {current} of {name}",
        ),
        ('f"{one} could hit {other}: command {other}"', "{one} could hit {other}: command {other}"),
    ],
)
def test_the_template_of_a_sentence_has_the_names_of_its_values(code: str, template: str) -> None:
    assert template_of(ast.parse(code, mode="eval").body, "go.py:3") == template


@pytest.mark.parametrize(
    ("code", "problem"),
    [
        ("text", "a sentence is a literal or an f-string"),
        ('f"{2 * gap} s"', "a value without a name: 2 * gap"),
        ('f"{a.speed} of {b.speed}"', "two values are called speed: rename one"),
    ],
)
def test_a_sentence_whose_template_is_not_clear_is_refused(code: str, problem: str) -> None:
    with pytest.raises(TextsError, match=re.escape(f"go.py:3: {problem}")):
        template_of(ast.parse(code, mode="eval").body, "go.py:3")


@OF_THE_WHOLE
@pytest.mark.parametrize(("domain", "language"), ALL)
def test_a_catalog_has_the_texts_of_the_code_and_no_others(
    domain: Domain, language: str, extracted: Callable[[Domain], Catalog]
) -> None:
    assert ids(domain.catalog_of(language)) == ids(extracted(domain)), "make texts"


@pytest.mark.parametrize(("domain", "language"), ALL)
def test_every_text_is_translated(domain: Domain, language: str) -> None:
    missing = [
        message.id for message in domain.catalog_of(language) if message.id and not is_translated(message)
    ]
    assert missing == []


@pytest.mark.parametrize(("domain", "language"), ALL)
def test_a_translation_has_the_placeholders_of_its_text(domain: Domain, language: str) -> None:
    for message in domain.catalog_of(language):
        if not message.id:
            continue
        wanted = {name for text in texts_of(message.id) for name in PLACEHOLDER.findall(text)}
        for text in texts_of(message.string):
            found = set(PLACEHOLDER.findall(text))
            # A plural form for one number, such as 1, may do without it.
            assert found == wanted or (isinstance(message.id, tuple) and found == wanted - {"count"}), text


@pytest.mark.parametrize(("domain", "language"), ALL)
def test_what_is_read_at_run_time_is_made_from_the_catalog(domain: Domain, language: str) -> None:
    catalog = domain.catalog_of(language)
    path = ROOT / domain.compiled.format(language=language)
    assert path.read_bytes() == domain.compile(catalog), "make texts"


@pytest.mark.parametrize(("domain", "language"), ALL)
def test_an_update_leaves_a_current_catalog_as_it_is(
    domain: Domain, language: str, extracted: Callable[[Domain], Catalog]
) -> None:
    path = LANGUAGES / language / f"{domain.name}.po"
    assert path.read_bytes() == updated(domain.catalog_of(language), extracted(domain)), "make texts"


@pytest.mark.parametrize("domain", DOMAINS, ids=lambda domain: domain.name)
def test_no_text_is_one_of_a_number_too(domain: Domain, extracted: Callable[[Domain], Catalog]) -> None:
    alone = {name for name in ids(extracted(domain)) if isinstance(name, str)}
    assert alone.isdisjoint(name[0] for name in ids(extracted(domain)) if isinstance(name, tuple))


@pytest.fixture(scope="module")
def rules() -> dict[str, list[list[str]]]:
    """The categories of each language, and those of the numbers below 1000, as a browser has them."""
    script = f"""
        console.log(JSON.stringify(Object.fromEntries({json.dumps(PLURALS)}.map((language) => {{
            const rules = new Intl.PluralRules(language);
            const selected = Array.from({{length: 1000}}, (_, i) => rules.select(i));
            return [language, [rules.resolvedOptions().pluralCategories, selected]];
        }}))));
    """
    done = subprocess.run(
        ["node", "-e", script], capture_output=True, text=True, timeout=RUN_LIMIT, check=True
    )
    found: dict[str, list[list[str]]] = json.loads(done.stdout)
    return found


@pytest.mark.parametrize("language", PLURALS)
def test_the_plural_forms_are_those_of_browsers(language: str, rules: dict[str, list[list[str]]]) -> None:
    catalog = added(DOMAINS[0], language)
    if language in languages():
        catalog = DOMAINS[0].catalog_of(language)
    categories, selected = rules[language]
    forms = forms_by_category(catalog)
    assert set(categories) <= set(forms)
    # Numbers of one category have one form: forms_by_category compares CLDR's categories, and these are the same.
    assert {forms[category] for category in selected} == set(range(catalog.num_plurals))


def test_a_catalog_whose_plurals_are_not_those_of_its_language_is_refused() -> None:
    catalog = added(DOMAINS[0], "es")
    catalog.mime_headers = [("Plural-Forms", "nplurals=2; plural=(n > 1);")]
    with pytest.raises(TextsError, match=r"es: \(n > 1\) has other forms than CLDR"):
        forms_by_category(catalog)


def test_an_unknown_language_is_refused(tmp_path: Path, domains: list[Domain]) -> None:
    (tmp_path / "visualhfsm" / "_base" / "languages").mkdir(parents=True)
    with pytest.raises(TextsError, match="'klingon' is no language of CLDR"):
        update(tmp_path, "klingon", domains)


def test_a_catalog_that_is_damaged_is_named(tmp_path: Path) -> None:
    path = tmp_path / "es" / "page.po"
    path.parent.mkdir()
    path.write_text('msgid "Run"\nEjecutar\n')
    with pytest.raises(TextsError, match=re.escape(str(path))):
        DOMAINS[0].catalog_of("es", tmp_path)


def test_a_language_is_added_by_one_command_and_its_texts(tmp_path: Path, domains: list[Domain]) -> None:
    (tmp_path / "visualhfsm" / "_base" / "languages").mkdir(parents=True)
    static = tmp_path / "visualhfsm" / "_editor" / "static"
    shutil.copytree(STATIC, static)
    count = update(tmp_path, "eo", domains)["eo"]
    assert count > 0

    path = tmp_path / "visualhfsm" / "_base" / "languages" / "eo" / "page.po"
    path.write_text(
        re.sub(r'^msgid "Run"\nmsgstr ""$', 'msgid "Run"\nmsgstr "Ruli"', path.read_text(), flags=re.M)
    )
    assert update(tmp_path, None, domains)["eo"] == count - 1
    texts = json.loads((static / "languages" / "eo.json").read_text())
    assert "Do not edit" in texts.pop("")
    assert texts == {"Run": "Ruli"}
    assert '<meta name="languages" content="eo es">' in Assets(static).page().html.decode()


def test_texts_with_a_number_are_known_by_the_categories_of_browsers() -> None:
    catalog = added(DOMAINS[0], "pl")
    catalog.add(("{count} state", "{count} states"), ("{count} stan", "{count} stany", "{count} stanów"))
    assert json.loads(texts_json(catalog))["{count} state"] == {
        "one": "{count} stan",
        "few": "{count} stany",
        "many": "{count} stanów",
        "other": "{count} stanów",
    }
