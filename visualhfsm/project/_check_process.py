"""The process that checks the documents of the editor, in which no code of a document is run."""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Final

import msgspec

from codegen.diagnostics import Severity
from codegen.hfsm.document import Document
from codegen.messages import Message
from codegen.reasons import reason
from visualhfsm._base.errors import EditError
from visualhfsm._base.languages import decode_message
from visualhfsm._base.line_process import LineProcess, NoAnswerError
from visualhfsm._document import problems
from visualhfsm._document.parts import split
from visualhfsm._document.problems import GIVE_UP, UNTITLED, Findings, Problem, ProblemsAnswer, Question
from zenoh_ice.data import typed

_CHECK_LIMIT: Final = 20.0
"""Limit of a check in seconds, and again without the model checker."""
_SOON: Final = 0.03
"""Seconds within which more must be found, or else what is known already is passed on."""


class CheckProcess:
    """A process that checks documents, one after the other; started on first use.

    `folder` is that of documents without a file, by default the current one: interfaces beside it are found.
    Thread-safe: callers wait for their turn.
    """

    def __init__(self, *, patience: float = _CHECK_LIMIT, folder: Path | None = None) -> None:
        self._patience = patience
        self._folder = folder or Path.cwd()
        self._process = LineProcess(problems.__name__)
        self._turn = threading.Lock()
        self._closed = threading.Event()

    def check(
        self,
        document: Document,
        path: Path | None,
        include: Sequence[Path] = (),
        meanwhile: Callable[[Findings], None] = lambda _: None,
    ) -> Findings:
        """Check a document. Raises EditError when it cannot be written, or the process has been ended.

        What takes no time is passed on to `meanwhile`, if the rest does.
        """
        try:
            parts = split(document)
        except UnicodeEncodeError as error:
            raise EditError("Cannot check the document", reason(error), "remove that character") from error
        for limit in (None, 0):
            if self._closed.is_set():
                raise EditError("Cannot check the document", "the checks have been ended")
            question = Question(parts, str(path or self._folder / UNTITLED), [*map(str, include)], limit)
            try:
                with self._turn:
                    found = self._ask(question, meanwhile)
            except (NoAnswerError, msgspec.MsgspecError):
                continue
            if limit is None:
                return found
            what = Message("this revision is not checked by the model checker, which took too long or failed")
            return _with(found, Severity.WARNING, what)
        what = Message("this revision is not checked by the checks, which took too long or failed")
        return _with(Findings(), Severity.ERROR, what)

    def give_up_search(self) -> None:
        """End what takes long of a check, if one runs: that returns what is found without it."""
        self._process.signal(GIVE_UP)

    def _ask(self, question: Question, meanwhile: Callable[[Findings], None]) -> Findings:
        answer = _answer(self._process.ask(msgspec.json.encode(question), self._patience))
        while not answer.is_last:
            answer = _answer(self._process.more(self._patience, _SOON, partial(meanwhile, answer.found)))
        if answer.refused:
            raise EditError(*answer.refused)
        return answer.found

    def close(self) -> None:
        """End the process; a check that is running ends without a result."""
        self._closed.set()
        self._process.close()


_answer: Final = typed.json_decoder(ProblemsAnswer, dec_hook=decode_message)


def _with(found: Findings, severity: Severity, message: Message) -> Findings:
    problem = Problem(code="", severity=severity, message=message)
    counts = Counter(found.counts) + Counter([severity])
    return msgspec.structs.replace(found, problems=(*found.problems, problem), counts=counts)
