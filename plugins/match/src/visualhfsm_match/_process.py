"""The process that plays matches: a line with a match, a line with its result.

It is the referee's: the code of the documents runs in sandboxes, one for each team.
"""

from __future__ import annotations

import ctypes
import gc
import os
import tempfile
import zlib
from contextlib import ExitStack, suppress
from pathlib import Path

from visualhfsm import VisualHfsmError
from visualhfsm.plugins import answer_tasks
from visualhfsm.trials import find_sandbox, quiet, unpack
from visualhfsm_match._film import Film
from visualhfsm_match._match import play
from visualhfsm_match._page import match_page
from visualhfsm_match._referee import BALL
from visualhfsm_match._series import PREFIX, Match, MatchAnswer, Played
from zenoh_ice.application.tether import die_with


def _answer(match: Match) -> MatchAnswer:
    plan = match.plan
    try:
        with tempfile.TemporaryDirectory(prefix=PREFIX) as name, ExitStack() as ends, quiet():
            live = None
            if match.film:
                live = ends.enter_context(Path(match.film).open("wb"))
            film, folder = Film(BALL, live), Path(name)
            unpack(match.archive.content, folder)
            sandboxes = []
            for document in plan.documents:
                files = [*(folder / document).parent.glob("*.xml")]
                sandbox = find_sandbox(files=files, unsafe=match.unsafe, seconds=plan.seconds)
                sandboxes.append(ends.enter_context(sandbox))
            result, cost = play(plan, folder, sandboxes, film)
        page = match_page(plan, result, film) if match.page else ""
    except VisualHfsmError as error:
        return MatchAnswer(refused=str(error))
    return MatchAnswer(Played(result, zlib.compress(page.encode()), cost))


def _answer_and_forget(match: Match) -> MatchAnswer:
    """Return the answer once what the match took is given back: otherwise ten matches take 2 GB."""
    answer = _answer(match)
    gc.collect()
    with suppress(AttributeError):  # glibc keeps room for pictures between what lasts
        ctypes.CDLL(None).malloc_trim(0)
    return answer


if __name__ == "__main__":
    die_with(os.getppid())  # a match would go on for minutes without noticing that nobody waits for it
    answer_tasks(_answer_and_forget)
