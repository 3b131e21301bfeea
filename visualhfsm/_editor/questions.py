"""Requests that ask about documents and their code, and change nothing.

Everything raises VisualHfsmError.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from itertools import islice
from typing import Any, Final

import msgspec

from codegen.hfsm.codes import Code
from codegen.hfsm.document import Document
from codegen.hfsm.known_interfaces import find_interfaces
from codegen.messages import NO_MESSAGE
from visualhfsm._base.errors import MissingError
from visualhfsm._document.diff import Difference, changed_lines, diff_documents
from visualhfsm._document.fixes import Fix, as_declared
from visualhfsm._document.fixes import fixes as find_fixes
from visualhfsm._document.places import search as search_document
from visualhfsm._document.problems import UNTITLED
from visualhfsm._document.reasons import summary
from visualhfsm._document.serialization import parse_file
from visualhfsm._document.views import AutomatonView, view
from visualhfsm._drawing.page import drawing_page
from visualhfsm._processes.bodies import body_option, known_body
from visualhfsm.project._code_help.definition import define
from visualhfsm.project._document import OpenDocument
from visualhfsm.project._editing.files import read_file
from visualhfsm.project._editing.imports import imported_views
from visualhfsm.trials import ways_to_fail

from . import answers as a
from . import protocol as p
from .tab import Tab
from .window import Window
from .workspace import Workspace

_MOST_LINES: Final = 200  # lines of the difference of a text
_SAVED: Final = "saved"  # a document may be compared with this instead of a file


async def code_help(workspace: Workspace, window: Window, request: p.CodeHelp) -> Any:  # noqa: ANN401
    """Answer a question about code that is being typed."""
    shown = workspace.tabs.get(request.tab).shown
    place, code, line, column = request.place, request.code, request.line, request.column
    if request.wanted == "define":
        return await workspace.threads.do(lambda: define(shown.document, place, code, line, column))
    return await workspace.code_questions.ask(
        window, request.wanted, shown, place, code, line=line, column=column
    )


async def fixes(workspace: Workspace, _: Window, request: p.Fixes) -> a.Fixes:
    """Return what fixes the problems of a document as it is shown, each fix once."""
    tab, project = workspace.tabs.get(request.tab), workspace.project
    shown, problems = tab.shown, [] if tab.problems is None else tab.problems.items
    asks = any(each.code == Code.UNKNOWN_ATTRIBUTE for each in problems)
    served = await workspace.parts.followers.identities() if asks else {}
    path = shown.path or project.root.directory / UNTITLED

    def find() -> a.Fixes:
        known = find_interfaces(path, project.include)
        found = find_fixes(shown.document, problems, as_declared(served, known))
        indices: dict[int, int] = {}
        listed: list[Fix] = []
        fixed: list[a.FixedProblem] = []
        for problem, several in zip(problems, found, strict=True):
            for fix in several:
                if id(fix) not in indices:
                    indices[id(fix)] = len(listed)
                    listed.append(fix)
            if several:
                fixed.append(
                    {
                        "code": problem.code,
                        "place": problem.place,
                        "line": problem.line,
                        "column": problem.column,
                        "fixes": [indices[id(fix)] for fix in several],
                    }
                )
        return {"fixes": listed, "problems": fixed}

    return await workspace.threads.do(find)


async def search(workspace: Workspace, _: Window, request: p.Search) -> list[a.Hits]:
    """Search in one document or in all open ones."""
    tabs: Sequence[Tab] = [*workspace.tabs] if request.tab is None else [workspace.tabs.get(request.tab)]
    shown = [(tab.id, tab.shown.document) for tab in tabs]
    text, whole = request.text, request.whole
    return await workspace.threads.do(
        lambda: [{"tab": number, "hits": search_document(each, text, whole=whole)} for number, each in shown]
    )


async def diff(workspace: Workspace, _: Window, request: p.Diff) -> a.Comparison:
    """Compare a document with a file, or with itself as it was saved."""
    tab = workspace.tabs.get(request.tab)
    if request.against == _SAVED:
        before = await tab.edit(lambda document: document.saved)
        if before is None:
            raise MissingError.because("{title} was never saved", title=tab.shown.title)
    else:
        path = workspace.project.root.document(request.against)
        other = workspace.tabs.of_file(path)
        if other is None or other is tab:
            before = await workspace.threads.do(lambda: parse_file(read_file(path)[0], path))
        else:
            before = other.shown.document
    return await workspace.threads.do(partial(_compared, before, tab.shown.document))


async def judge(workspace: Workspace, _: Window, request: p.Judge) -> a.Judged:
    """Judge a document as it was saved, after others: each takes a thread for seconds."""
    tab, root = workspace.tabs.get(request.tab), workspace.project.root.directory
    body = await workspace.threads.do(partial(known_body, root, request.body))
    judging = partial(tab.document.verdict, body=body_option(root, body.name))
    async with workspace.judging:
        verdict = await workspace.threads.do(judging)
    first = verdict.reasons[0] if verdict.reasons else None
    return {
        "ready": verdict.ready,
        "found": "" if first is None else first.found,
        "message": NO_MESSAGE if first is None else summary(verdict.reasons, terminal=False),
        "place": None if first is None else first.place,
        "proved": len(verdict.proved),
        "tests": verdict.tests,
        "survived": sum(each.held for each in verdict.survivals),
        "seconds": verdict.seconds,
        "missed": list(verdict.missed),
        "robot": body.title,
    }


async def failures(workspace: Workspace, _: Window, request: p.Failures) -> dict[str, list[str]]:
    """Return how each part of a robot can fail."""
    root = workspace.project.root.directory
    return await workspace.threads.do(
        lambda: ways_to_fail(body_option(root, known_body(root, request.body).name))
    )


async def export(workspace: Workspace, _: Window, request: p.Export) -> a.Download:
    """Return a document as its file would hold it, or as a page."""
    tab = workspace.tabs.get(request.tab)
    if request.page:
        shown = tab.shown
        content = await imported_by(workspace, tab)
        name = shown.title
        page = await workspace.threads.do(lambda: drawing_page(name, shown.document, content))
        return {"name": f"{name}.html", "text": page}
    text = await tab.edit(OpenDocument.text)
    return {"name": f"{tab.shown.title}.xml", "text": text}


async def locate(workspace: Workspace, _: Window, request: p.Locate) -> a.Located | None:
    """Return the code to which a line of a log refers."""
    source = workspace.tabs.get(request.tab).source
    found = await workspace.parts.started.locate(source, request.text, request.automaton, request.state)
    return None if found is None else {"place": found.place, "line": found.line}


async def imported_by(workspace: Workspace, tab: Tab) -> list[AutomatonView]:
    """Return the content of the automata that the document of a tab imports."""
    shown = tab.shown
    if (path := shown.path) is None:
        return []  # imports are relative to the file
    return await workspace.threads.do(lambda: imported_views(shown.document, path, workspace.project.include))


def _compared(before: Document, after: Document) -> a.Comparison:
    """Return the differences, with the former automata, so that removed elements can be drawn."""
    differences = diff_documents(before, after)
    affected = {each.place.automaton for each in differences}
    return {
        "differences": [_with_lines(each) for each in differences],
        "before": [view(each) for each in before.automata if each.id in affected],
    }


def _with_lines(difference: Difference) -> Difference:
    """Return a difference with the lines that differ in it."""
    lines = tuple(islice(changed_lines(difference), _MOST_LINES))
    return msgspec.structs.replace(difference, lines=lines)
