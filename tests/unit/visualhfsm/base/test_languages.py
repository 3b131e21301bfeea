"""Which of the editor's languages a browser gets."""

from __future__ import annotations

import pytest

from codegen.messages import Message
from visualhfsm._base.languages import accepted_language, known_language, said, system_languages


@pytest.mark.parametrize(
    ("wanted", "found"), [("es", "es"), ("es-MX", "es"), ("ES", "es"), ("de", "en"), ("", "en")]
)
def test_a_language_is_known_by_its_code(wanted: str, found: str) -> None:
    assert known_language(wanted) == found


@pytest.mark.parametrize(
    ("header", "found"),
    [
        ("es-ES,es;q=0.9,en;q=0.8", "es"),
        ("en-US,en;q=0.9,es;q=0.8", "en"),
        ("en;q=0.5, es;q=0.8", "es"),
        ("es;q=0.8,en;q=0.8", "es"),
        ("ca,gl;q=0.9,es;q=0.8,en;q=0.7", "es"),
        ("de-DE,de", "en"),
        ("es;q=0", "en"),
        ("*", "en"),
        ("", "en"),
        ("es;q=x", "en"),
        (";;,=,q=1;", "en"),
        (600 * "x" + ",es", "en"),
    ],
)
def test_the_most_wanted_language_that_there_is_is_accepted(header: str, found: str) -> None:
    assert accepted_language(header) == found


def test_a_message_is_said_in_a_language() -> None:
    message = Message("`{name}` is not defined", name="x")
    assert (said(message, "es"), said(message, "en")) == ("`x` no está definido", "`x` is not defined")


@pytest.mark.parametrize(
    ("environment", "found"),
    [
        ({"LANG": "es_ES.UTF-8"}, ["es"]),
        ({"LANG": "en_US.UTF-8", "LC_ALL": "", "LC_MESSAGES": "es_MX"}, ["es"]),
        ({"LANG": "en_US.UTF-8", "LC_MESSAGES": "fr_FR", "LC_ALL": "es_ES@euro"}, ["es"]),
        ({"LANG": "en_US.UTF-8", "LANGUAGE": "ca:es_ES"}, ["ca", "es"]),
        ({"LANGUAGE": "es"}, ["es"]),
        ({"LANGUAGE": "es", "LANG": "C.UTF-8"}, ["es"]),
        ({"LANGUAGE": "es", "LC_ALL": "C", "LANG": "es_ES.UTF-8"}, ["C"]),
        ({}, [""]),
    ],
)
def test_the_environment_names_the_languages_of_a_user(environment: dict[str, str], found: list[str]) -> None:
    assert system_languages(environment) == found
