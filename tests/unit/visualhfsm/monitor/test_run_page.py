"""A run as one HTML file: all of it is inside, and nothing of the run is read as HTML or script."""

from __future__ import annotations

import base64
import json
import os
import re
import threading
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

from codegen.hfsm.document import Document
from codegen.messages import Message
from tests.support.component import dance_and_follow
from tests.support.documents import document, state, sub, transition
from tests.support.limits import EVENT_LIMIT
from tests.support.watching import content, recorded
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._base.html_file import check_place
from visualhfsm._document.serialization import parse
from visualhfsm._monitor.realm.run_log import RunLog
from visualhfsm._monitor.run_page import ExportedRun, run_page, write_run_page

HOSTILE = "</script><script>alert(1)</script><img src=x onerror=alert(2)>"


def drawn(name: str = "stand", code: str = "beats = 1") -> Document:
    return parse(
        document(
            sub(1, 0, state(1, name, code, initial=True), state(2, "walk"),
                transition(1, 1, 2, "True")),
        ),
        Message("Cannot read"),
    )  # fmt: skip


def run(**changes: Any) -> ExportedRun:
    return replace(ExportedRun("walker", dance_and_follow(), recorded(3.0), drawn()), **changes)


def modules(page: str) -> dict[str, str]:
    found = re.search(r'type="importmap">(.*?)</script>', page)
    assert found
    imports: dict[str, str] = json.loads(found[1])["imports"]
    prefix = "data:text/javascript;base64,"
    assert all(url.startswith(prefix) for url in imports.values())
    return {name: base64.b64decode(url.removeprefix(prefix)).decode() for name, url in imports.items()}


def test_the_page_has_every_module_that_its_modules_import() -> None:
    found = modules(run_page(run()))
    ours = {name: text for name, text in found.items() if "/" in name or name.endswith(".js")}
    wanted = {
        target
        for text in ours.values()
        for target in re.findall(
            r'^(?:import|export)\s(?:[^"\';]*?\sfrom\s)?\s*"([^"]+)"', text, re.MULTILINE
        )
    }
    assert {"lit", "three", "uplot", "canvas/drawing.js", "run/timeline.js"} <= wanted
    assert wanted <= found.keys()
    assert "codemirror" not in found


def test_the_page_loads_nothing_and_its_policy_forbids_it() -> None:
    page = run_page(run())
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', page)
    assert policy
    nonce = re.search(r"script-src 'nonce-([^']+)';", policy[1])
    assert nonce
    assert policy[1].startswith("default-src 'none'; ")
    assert "unsafe" not in policy[1]
    assert "connect-src" not in policy[1]
    outside = re.sub(r"base64,[^\"]*|id=\"run\">[^<]*", "", page)
    assert not re.findall(r"""(?:src|href)\s*=|url\((?!["']?data:)|@import|https?:""", outside)
    assert page.count(f'nonce="{nonce[1]}"') == 4
    assert nonce[1] not in run_page(run())


class Tags(HTMLParser):
    """The tags of a page, and its title."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.found: list[str] = []
        self.title = ""
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found.append(tag)

    def handle_data(self, data: str) -> None:
        if self.found[-1:] == ["title"]:
            self.title += data.strip()


def test_names_variables_and_code_cannot_become_script() -> None:
    structure = dance_and_follow()
    structure.automata[0].states[0].name = HOSTILE
    moment = recorded(1.0).newest
    assert moment is not None
    moment.component.automata[0].variables = {HOSTILE: repr(HOSTILE)}
    log = RunLog()
    log.add(moment)
    document = drawn(HOSTILE, f"text = '{HOSTILE}'")
    page = run_page(run(name=HOSTILE, structure=structure, log=log, document=document))
    tags = Tags(page)
    assert tags.found == Tags(run_page(run())).found
    assert tags.title == HOSTILE
    assert page.count("alert") == 2  # in the title
    found, (shown,) = content(page)
    assert found["document"]["automata"][0]["states"][0]["name"] == HOSTILE
    assert HOSTILE in found["document"]["automata"][0]["states"][0]["code"]
    assert shown["component"]["automata"][0]["variables"] == {HOSTILE: repr(HOSTILE)}


def test_the_content_is_the_run() -> None:
    picture = b"\xff\xd8 a picture"
    found, moments = content(run_page(run(pictures={"Camera": [(1.5, picture)]})))
    assert found["name"] == "walker"
    assert found["times"] == [moment["component"]["time"] for moment in moments]
    assert found["timeline"]["end"] == pytest.approx(2.9)
    assert [each["name"] for each in found["structure"]["structure"]["automata"]][:2] == [
        "dance_and_follow",
        "followBall",
    ]
    assert found["pictures"] == {"Camera": [[1.5, base64.b64encode(picture).decode()]]}
    assert found["body"]["meshes"]


def test_a_run_without_a_document_is_exported() -> None:
    assert content(run_page(run(document=None)))[0]["document"] is None


def test_a_page_that_is_too_large_is_refused() -> None:
    with pytest.raises(VisualHfsmError, match=r"would have \d+ MB, and at most 3 MB can be exported: record"):
        run_page(run(pictures={"Camera": [(1.5, os.urandom(2 << 20))]}), largest=3 << 20)


def test_nothing_is_not_exported() -> None:
    with pytest.raises(VisualHfsmError, match="nothing is known of a run of walker"):
        run_page(run(log=RunLog()))


def test_a_file_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    size = write_run_page(tmp_path / "new" / "run.html", run())
    assert (tmp_path / "new" / "run.html").stat().st_size == size
    for act in (lambda path: write_run_page(path, run()), check_place):
        with pytest.raises(VisualHfsmError, match="cannot be written"):
            act(tmp_path / "new" / "run.html" / "run.html")


def test_a_page_takes_the_place_of_one_of_ours_alone(tmp_path: Path) -> None:
    page = tmp_path / "run.html"
    write_run_page(page, run())
    check_place(page)
    page.write_text("my notes", "utf-8")
    with pytest.raises(VisualHfsmError, match="is no page that VisualHFSM wrote"):
        check_place(page)
    check_place(page, force=True)


def test_a_link_stays_a_link(tmp_path: Path) -> None:
    link = tmp_path / "link.html"
    link.symlink_to(tmp_path / "run.html")
    write_run_page(link, run())
    assert link.is_symlink()
    assert (tmp_path / "run.html").is_file()


def test_a_pipe_is_written_to_and_not_replaced(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    read: list[str] = []
    reader = threading.Thread(target=lambda: read.append(pipe.read_text(encoding="utf-8")), daemon=True)
    reader.start()
    write_run_page(pipe, run())
    reader.join(EVENT_LIMIT)
    assert pipe.is_fifo()
    assert read[0].rstrip().endswith("</html>")
