"""The documentation of a project as one HTML file: what its documents say, prove, and are tested for.

The file contains the modules of the editor's page that `_editor/static/onefile/document-page.js` imports, and
a `Chapter` for each document. Nothing of a document is read as HTML or script.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import islice
from pathlib import Path
from typing import Any, Final

import msgspec

from codegen.diagnostics import Diagnostics, Severity
from codegen.hfsm import resolve
from codegen.messages import NO_MESSAGE, Message
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._base.html_file import html_file
from visualhfsm._base.languages import in_all_languages
from visualhfsm._document.geometry import spread
from visualhfsm._document.problems import Problem
from visualhfsm._document.views import view
from visualhfsm._processes.test_results import Passed, PassedCode, TestView
from visualhfsm._processes.tests import MOST_CODE, passed_code, passed_in, view_of
from visualhfsm.project._project import Project

_ENTRY: Final = "onefile/document-page.js"
_STYLES: Final = tuple(f"styles/{name}" for name in ("theme", "canvas", "document-page"))


class Chapter(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    """What the page says of a document; one that cannot be read has `failures` alone.

    `failures` are why it was not read or judged, and what went wrong in its run or its tests as a whole.
    `proved` says that the model checker has come to its end.
    """

    name: str
    path: str
    failures: tuple[Message | str, ...] = ()
    document: Mapping[str, Any] | None = None
    problems: tuple[Problem, ...] = ()
    counts: Mapping[Severity, int] = {}
    proved: bool = False
    seconds: float = 0.0
    """The virtual time for which it ran."""
    tests: tuple[TestView, ...] = ()
    passed: tuple[Passed, ...] = ()
    code: tuple[PassedCode, ...] = ()
    unmeasured: Message = NO_MESSAGE


def chapter_of(project: Project, path: Path, *, runs: bool, patience: float) -> Chapter:
    """Return what is known of a document; with `runs` it runs, and its tests, each at most `patience` s.

    What cannot be found out is among its failures.
    """
    chapter = Chapter(name=path.stem, path=project.root.name(path.resolve()))
    try:
        opened = project.open(path)
        document = resolve(opened.version.document, path, Diagnostics(), project.include)
        automata = [view(spread(each)) for each in document.automata]
        chapter = msgspec.structs.replace(chapter, document={**view(document), "automata": automata})
        judged = opened.judge(patience=patience, runs=runs)
    except VisualHfsmError as error:
        return msgspec.structs.replace(chapter, failures=(error.message,))
    verdict, findings, tests = judged.verdict, judged.findings, judged.tests
    named = {each.name for each in tests}
    of_runs = (each for each in verdict.reasons if each.found in {"run", "tests"})
    return msgspec.structs.replace(
        chapter,
        failures=tuple(each.text for each in of_runs if each.where not in named),
        problems=findings.problems,
        counts=findings.counts,
        proved=findings.proofs is not None,
        seconds=0.0 if findings.counts.get(Severity.ERROR) else verdict.seconds,
        tests=tuple(view_of(each.name, each) for each in tests),
        passed=tuple(passed_in(judged.file, tests)),
        code=tuple(islice(passed_code(judged.file, tests), MOST_CODE)),
        unmeasured=next((each.unmeasured for each in tests if each.unmeasured), NO_MESSAGE),
    )


def documentation_page(name: str, chapters: Sequence[Chapter]) -> str:
    """Return the page of a project as HTML."""
    content = msgspec.json.encode({"name": name, "chapters": chapters}, enc_hook=in_all_languages)
    return html_file(name, _ENTRY, _STYLES, content)
