"""Completion of code at which jedi fails."""

from __future__ import annotations

from pathlib import Path

from visualhfsm.project._code_help.completion import complete
from visualhfsm.project._code_help.component import TypedComponent
from visualhfsm.project._code_help.parsed_files import with_readable_files

# Jedi looks further into packages of this name, as into numpy, and fails at the ellipsis.
PACKAGE = """
class Tensor:
    def __init__(self, shape: tuple[int, ...] = ...) -> None: ...

def zeros() -> Tensor: ...
"""


def test_a_name_at_which_jedi_fails_is_offered_beside_the_others(tmp_path: Path) -> None:
    (tmp_path / "tensorflow.py").write_text(PACKAGE, "utf-8")
    module = TypedComponent("", "", "", directories=(tmp_path,))
    code = "import tensorflow\ntensorflow."
    typed = module.with_code(code)
    found = with_readable_files(lambda: complete(typed, tmp_path / "main.xml", 2, len("tensorflow.")))
    assert {"Tensor", "zeros"} <= {each.label for each in found.options}


def test_names_are_explained_in_sentences_and_keywords_not_at_all(tmp_path: Path) -> None:
    typed = TypedComponent("", "", "").with_code("pri\nbrea")
    path = tmp_path / "main.xml"
    names = with_readable_files(lambda: complete(typed, path, 1, 3)).options
    explained = {each.label: each.info for each in names}
    assert explained["print"] == "Prints the values to a stream, or to sys.stdout by default."
    keywords = with_readable_files(lambda: complete(typed, path, 2, 4)).options
    assert {each.label: each.info for each in keywords}["break"] == ""
