"""The tests of a document are found by reading their files, before any is run."""

from __future__ import annotations

from pathlib import Path

import pytest

from visualhfsm._processes import document_tests

TESTS = '''
"""Tests of lamp.xml."""

def test_it(behavior): ...

def helper(): ...

class TestMore:
    def test_that(self): ...
'''


@pytest.fixture
def document(tmp_path: Path) -> Path:
    (tmp_path / "tests").mkdir()
    (tmp_path / "tests" / "test_other.py").write_text("def test_another(): ...")
    return tmp_path / "lamp.xml"


def test_functions_and_methods_of_files_that_name_the_document_are_tests(document: Path) -> None:
    root = document.parent
    (root / "tests" / "test_lamp.py").write_text(TESTS)
    files = document_tests.test_files(document, root)
    assert document_tests.find_tests(files, document, root) == [
        "tests/test_lamp.py::test_it",
        "tests/test_lamp.py::TestMore::test_that",
    ]


@pytest.mark.parametrize("text", [b"# lamp.xml\ndef test_it(:", b"# lamp.xml \0", b"# lamp.xml\n\xff = 1"])
def test_a_file_that_python_cannot_read_is_one_test(document: Path, text: bytes) -> None:
    root = document.parent
    (root / "test_lamp.py").write_bytes(text)
    assert document_tests.find_tests(document_tests.test_files(document, root), document, root) == [
        "test_lamp.py"
    ]
