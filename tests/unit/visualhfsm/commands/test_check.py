"""`visualhfsm check`: exit codes, formats, directories, imports, and the model checker's verdicts."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from codegen.command import app as codegen
from codegen.hfsm.model_checker import ASSUMPTIONS
from tests.support.documents import document, state, sub, transition
from tests.support.places import ROOT
from visualhfsm._commands.app import app

CLEAN = document(sub(1, 0, state(1, "wait", initial=True)))
WARNING = document(sub(1, 0, state(1, "wait", "distance = 3", initial=True)))
ERROR = document(sub(1, 0, state(1, "wait", "x = = 1", initial=True)))
UNBOUND = document(sub(1, 0, state(1, "wait", "def f(): nonlocal x", initial=True)))
"""Only its component as a whole shows what is wrong."""
LAMP = "<iceinterface><nameinterface>Lamp</nameinterface><nameproxy>Lamp</nameproxy><interface>Lamp</interface></iceinterface>"
TWO_STATES = sub(
    1, 0, state(1, "walk", initial=True), state(2, "rest"),
    transition(1, 1, 2, "tired"), transition(2, 2, 1, "1000", type="time"), variables="tired = False",
)  # fmt: skip
TOO_LATE = sub(
    1, 0, state(1, "walk", "distance = 3", initial=True), state(2, "rest"), state(3, "lost"),
    transition(1, 1, 2, "10", type="time"), transition(2, 1, 3, "100", type="time"),
    transition(3, 2, 1, "100", type="time"), transition(4, 3, 1, "100", type="time"),
)  # fmt: skip
"""One of its transitions can never fire, unless a cycle is missed."""


def run(*arguments: str | Path) -> Result:
    return CliRunner().invoke(app, ["check", *map(str, arguments)])


def write(directory: Path, name: str, text: str) -> Path:
    path = directory / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return path


def stated(kind: str, expression: str, within: str = "") -> str:
    return (
        f'<properties><property kind="{kind}"><name>it rests</name><within>{within}</within>'
        f"<expression>{expression}</expression></property></properties>"
    )


def test_a_clean_document_ends_with_0(tmp_path: Path) -> None:
    result = run(write(tmp_path, "clean.xml", CLEAN))
    assert (result.exit_code, result.stdout, result.stderr) == (0, "1 document: nothing to report\n", "")


def test_a_warning_fails_only_when_it_is_strict(tmp_path: Path) -> None:
    path = write(tmp_path, "doubtful.xml", WARNING)
    assert run(path).exit_code == 0
    result = run(path, "--strict")
    assert result.exit_code == 1
    assert "doubtful.xml:3:91: warning[W521]: the variable `distance` is never read" in result.stderr
    assert "^~~~~~~~" in result.stderr
    assert result.stdout == "1 document: 1 warning\n"


@pytest.mark.parametrize("wrong", [ERROR, UNBOUND])
def test_an_error_fails(tmp_path: Path, wrong: str) -> None:
    result = run(write(tmp_path, "wrong.xml", wrong))
    assert result.exit_code == 1
    assert "error[E520]" in result.stderr
    assert "1 error" not in result.stderr, "the summary has it"
    assert result.stdout == "1 document: 1 error\n"


def test_characters_in_the_name_of_a_file_control_no_terminal(tmp_path: Path) -> None:
    properties = TWO_STATES.replace("</SubAutomata>", stated("reachable", "rest") + "</SubAutomata>")
    for text in (WARNING, document(properties)):
        result = run(write(tmp_path, "b\x07\x1b[31mr\u202eed.xml", text))
        assert r"b\x07\x1b[31mr\u202eed.xml:" in result.output
        assert not set("\x07\x1b\u202e") & set(result.output)


def test_nothing_is_written(tmp_path: Path) -> None:
    path = write(tmp_path, "clean.xml", CLEAN)
    run(path)
    assert list(tmp_path.iterdir()) == [path]


def test_directories_are_searched_for_documents_alone(tmp_path: Path) -> None:
    write(tmp_path, "a.xml", CLEAN)
    write(tmp_path, "deep/er/b.xml", WARNING)
    write(tmp_path, "package.xml", "<package><name>other</name></package>")
    result = run(tmp_path)
    assert result.exit_code == 0
    assert result.stdout == "2 documents: 1 warning\n"


@pytest.mark.parametrize("arguments", [(), ("notes.txt",), (".",), ("a.xml", "-I", "absent")])
def test_wrong_usage_ends_with_2(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: tuple[str, ...]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(*arguments).exit_code == 2


def test_a_missing_file_is_an_error(tmp_path: Path) -> None:
    result = run(tmp_path / "absent.xml")
    assert result.exit_code == 1
    assert "error[E500]" in result.stderr


def test_what_is_neither_file_nor_directory_does_not_exist(tmp_path: Path) -> None:
    result = run(tmp_path / "absent")
    assert result.exit_code == 2
    assert "does not exist" in " ".join(result.stderr.replace("│", "").split())


def test_json_is_all_that_is_written(tmp_path: Path) -> None:
    result = run(write(tmp_path, "doubtful.xml", WARNING), "--error-format", "json")
    assert result.stdout == ""
    (found,) = json.loads(result.stderr)
    assert (found["severity"], found["code"], found["line"], found["length"]) == ("warning", "W521", 3, 8)


def test_annotations_of_github(tmp_path: Path) -> None:
    result = run(write(tmp_path, "doubtful.xml", WARNING), "--error-format", "github")
    assert result.stderr.startswith("::warning file=")
    assert result.stdout == ""


def test_what_is_imported_is_checked_at_its_own_place(tmp_path: Path) -> None:
    write(tmp_path, "library.xml", document(sub(1, 0, state(1, "look", "distnace = 3", initial=True))))
    stub = '<SubAutomata id="2" idFather="1"><import automaton="0">library.xml</import></SubAutomata>'
    path = write(tmp_path, "main.xml", document(sub(1, 0, state(1, "search", initial=True, child=2)), stub))
    result = run(path)
    assert "library.xml:3:91: warning[W521]: the variable `distnace` is never read" in result.stderr


def test_a_property_that_holds_is_reported(tmp_path: Path) -> None:
    path = write(tmp_path, "main.xml", document(TWO_STATES, head=stated("always", "walk or rest")))
    result = run(path)
    assert result.exit_code == 0, result.stderr
    assert result.stdout == f"{path}: `it rests` holds\n{ASSUMPTIONS}\n1 document: nothing to report\n"


@pytest.mark.parametrize("head", ["", stated("always", "walk or rest or lost")])
def test_what_can_never_happen_is_said_with_its_assumptions_once(tmp_path: Path, head: str) -> None:
    for name in ("one", "two"):
        write(tmp_path, f"{name}.xml", document(TOO_LATE, head=head))
    result = run(tmp_path)
    assert result.stderr.count("can never fire") == 2
    assert result.stderr.endswith(f"{ASSUMPTIONS}\n")
    assert result.output.count(ASSUMPTIONS) == 1


def test_the_generator_says_the_assumptions_too(tmp_path: Path) -> None:
    path = write(tmp_path, "late.xml", document(TOO_LATE))
    result = CliRunner().invoke(codegen, ["--check", str(path)])
    assert "can never fire" in result.stderr
    assert result.stderr.count(ASSUMPTIONS) == 1


def test_programs_find_the_assumptions_with_each_thing_that_can_never_happen(tmp_path: Path) -> None:
    path = write(tmp_path, "late.xml", document(TOO_LATE))
    found = json.loads(run(path, "--error-format", "json").stderr)
    assert {each["code"]: each.get("assumes") for each in found} == {"W517": ASSUMPTIONS, "W521": None}
    lines = run(path, "--error-format", "github").stderr.splitlines()
    assert [line.endswith(ASSUMPTIONS) for line in lines] == ["W517" in line for line in lines]


def test_what_is_certain_in_any_case_assumes_nothing(tmp_path: Path) -> None:
    assert ASSUMPTIONS not in run(write(tmp_path, "doubtful.xml", WARNING)).output


def test_the_page_has_the_same_assumptions_of_a_proof() -> None:
    script = (ROOT / "visualhfsm/_editor/static/code/verdicts.js").read_text(encoding="utf-8")
    (literals,) = re.findall(r"ASSUMPTIONS = t\(\n((?: +\"[^\"]*\"[ +,]*\n)+)", script)
    assert "".join(re.findall(r'"([^"]*)"', literals)) == ASSUMPTIONS


def test_a_property_that_is_violated_is_an_error_with_the_steps_to_it(tmp_path: Path) -> None:
    path = write(tmp_path, "main.xml", document(TWO_STATES, head=stated("never", "rest")))
    result = run(path)
    assert result.exit_code == 1
    assert "error[E610]" in result.stderr
    assert re.search(r"^ +1\. +0\.000 s  ", result.stderr, re.MULTILINE)
    assert "`walk` -> `rest` by transition 1" in result.stderr
    assert f"{path}: `it rests` is violated" in result.stdout


def test_the_model_can_be_left_out(tmp_path: Path) -> None:
    path = write(tmp_path, "main.xml", document(TWO_STATES, head=stated("never", "rest")))
    result = run(path, "--no-model")
    assert (result.exit_code, result.stdout) == (0, "1 document: nothing to report\n")


def test_what_the_checks_report_the_model_does_not_report_again(tmp_path: Path) -> None:
    automaton = sub(
        1, 0, state(1, "walk", initial=True), state(2, "rest"), state(3, "sit"),
        transition(1, 1, 2, "1000", type="time"), transition(2, 1, 3, "5000", type="time"),
        transition(3, 2, 1, "1000", type="time"), transition(4, 3, 1, "1000", type="time"),
    )  # fmt: skip
    result = run(write(tmp_path, "main.xml", document(automaton)))
    assert result.stderr.count("warning[") == 1
    assert "W517" in result.stderr


@pytest.mark.parametrize(
    ("schema", "place", "problem"),
    [
        ('{\n<<<<<<< HEAD\n "definitions": {}\n}\n', "schema.json:2:1:", "is not JSON: Expecting property name"),
        ("[]", "schema.json:", "was not generated by codegen"),
        ('{"definitions": {"::lab::Lamp": {"kind": "interface", "operations": 5}}}', "schema.json:", "was not generated"),
        ("\xff", "schema.json:", "was not generated by codegen"),
    ],
)  # fmt: skip
def test_a_broken_description_of_interfaces_is_an_error_with_its_file(
    tmp_path: Path, schema: str, place: str, problem: str
) -> None:
    write(tmp_path, "lab/__init__.py", "")
    write(tmp_path, "lab/lamp.py", "class LampPrx(ObjectPrx):\n    pass\n")
    (tmp_path / "lab" / "schema.json").write_text(schema, encoding="latin-1")
    path = write(tmp_path, "main.xml", document(TWO_STATES, config=LAMP, head=stated("never", "rest")))
    result = run(path, "-I", tmp_path)
    assert result.exit_code == 1
    assert (
        f"{tmp_path / 'lab'}/{place} error[E605]: the description of package `lab` {problem}" in result.stderr
    )
    assert "it rests" not in result.stdout, "the model checker has not looked"
