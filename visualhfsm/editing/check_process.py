"""Check documents in a process beside, so that the editor never waits for a check.

No code of a document is run in it.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import msgspec

from codegen.hfsm.document import Document
from codegen.hfsm.model_checker import DEFAULT_LIMIT
from visualhfsm.line_process import LineProcess, NoAnswerError, answer_lines

from .errors import EditError
from .fragments import written
from .problems import Problem, find_problems_in_text

__all__ = ["CheckProcess"]

_PATIENCE: Final = 20.0
"""Seconds that a check may take, and another time without the model checker."""


class _Question(msgspec.Struct, frozen=True):
    text: str
    path: str | None
    include: list[str]
    limit: int


class CheckProcess:
    """A process that checks documents, one after the other; it is started when it is first needed.

    Safe to be used from several threads: each waits for its turn.
    """

    def __init__(self, *, patience: float = _PATIENCE) -> None:
        self._patience = patience
        self._process = LineProcess(__name__)
        self._closed = threading.Event()

    def find_problems(
        self, document: Document, path: Path | None, include: Sequence[Path] = ()
    ) -> list[Problem]:
        """Return what is wrong in a document. Raises EditError when it cannot be written, or checked."""
        text = written(document)
        for limit in (DEFAULT_LIMIT, 0):
            if self._closed.is_set():
                raise EditError("Cannot check the document", "the checks have been ended")
            question = _Question(text, None if path is None else str(path), [*map(str, include)], limit)
            try:
                answer = self._process.ask(msgspec.json.encode(question), self._patience)
                problems = msgspec.json.decode(answer, type=list[Problem])
            except (NoAnswerError, msgspec.MsgspecError):
                continue
            return problems if limit else [*problems, _unchecked("model checker")]
        return [_unchecked("checks")]

    def close(self) -> None:
        """End the process; a check that is running ends without a result."""
        self._closed.set()
        self._process.close()


def _unchecked(what: str) -> Problem:
    message = f"this revision is not checked by the {what}, which took too long or failed"
    return Problem(code="", severity="warning", message=message)


def _answer(line: bytes) -> bytes:
    question = msgspec.json.decode(line, type=_Question)
    problems = find_problems_in_text(
        question.text,
        None if question.path is None else Path(question.path),
        [Path(directory) for directory in question.include],
        limit=question.limit,
    )
    return msgspec.json.encode(problems)


if __name__ == "__main__":
    answer_lines(_answer)
