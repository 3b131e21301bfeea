"""A drawing as one HTML file: all of it is inside, and nothing of the document is read as HTML or script."""

from __future__ import annotations

import base64
import gzip
import json
import re
from typing import Any

from codegen.hfsm.document import Annotation, Automaton, Document, State, Text
from visualhfsm._drawing.page import drawing_page

HOSTILE = "</script><script>alert(1)</script><img src=x onerror=alert(2)>"


def drawn(name: str = "stand", text: str = "why") -> Document:
    note = Annotation(id=1, x=10, y=20, width=120, height=60, text=Text(text))
    state = State(id=1, name=name, code=Text(text))
    return Document(automata=(Automaton(id=1, states=(state,), annotations=(note,)),))


def data(page: str) -> Any:
    found = re.search(r'<script type="text/plain" id="data">(.*?)</script>', page)
    assert found
    return json.loads(gzip.decompress(base64.b64decode(found[1])))


def test_the_page_has_the_whole_document() -> None:
    content = data(drawing_page("dance", drawn()))
    assert content["name"] == "dance"
    (automaton,) = content["document"]["automata"]
    assert automaton["states"][0]["name"] == "stand"
    assert automaton["annotations"][0]["text"] == "why"


def test_nothing_of_the_document_becomes_markup() -> None:
    page = drawing_page(HOSTILE, drawn(HOSTILE, HOSTILE))
    assert "alert(" not in page.replace("&lt;", "<").split("<body>")[1]
    assert "<img" not in page.split("<body>")[1]
    assert data(page)["document"]["automata"][0]["states"][0]["name"] == HOSTILE


def test_the_page_connects_to_nothing() -> None:
    found = re.search(r'Content-Security-Policy" content="([^"]*)"', drawing_page("dance", drawn()))
    assert found
    assert "default-src 'none'" in found[1]
    assert "connect-src" not in found[1]


def test_the_page_has_every_module_that_its_modules_import() -> None:
    found = re.search(r'type="importmap">(.*?)</script>', drawing_page("dance", drawn()))
    assert found
    prefix = "data:text/javascript;base64,"
    modules = {
        name: base64.b64decode(url.removeprefix(prefix)).decode()
        for name, url in json.loads(found[1])["imports"].items()
    }
    ours = [text for name, text in modules.items() if name.endswith(".js")]
    wanted = {
        target
        for text in ours
        for target in re.findall(r"""^\s*(?:import|export)\s(?:[^"';]*?\sfrom\s)?\s*"([^"]+)";""", text, re.M)
    }
    assert "onefile/selected-code.js" in wanted
    assert wanted <= modules.keys()
