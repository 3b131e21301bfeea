"""Branches of a project merge with plain Git: the component where its document does, line by line."""

from __future__ import annotations

import difflib
import html
import os
import subprocess
from pathlib import Path

from codegen.diagnostics import Diagnostics
from codegen.hfsm import compile_document, parse_document
from codegen.hfsm.formats.writer import write_document
from hfsm_runtime.places import Line, read_source
from tests.support.codegen_command import codegen
from tests.support.documents import document, state, sub, transition
from tests.support.limits import RUN_LIMIT

WALK = """\
steps += 1
if steps > limit:
    text = '''
# </code 1.1>
import math
'''
    self.log.info(text)"""
FUNCTIONS = """\
def half(self, number):
    return number / 2

def twice(self, number):
    return number * 2

def thrice(self, number):
    return number * 3"""
PATROL = parse_document(
    document(
        sub(
            1,
            0,
            state(1, "walk", WALK, initial=True, child=2),
            state(2, "rest"),
            state(3, "sleep", "# sleep\nsteps = 0"),
            state(4, "wake", "steps = 1"),
            transition(1, 1, 2, "steps > limit", name="tired"),
            transition(2, 2, 3, "500", type="time", code="steps -= 1", name="later"),
            transition(3, 3, 4, "500", type="time", name="wake"),
            variables="steps = 0\nlimit = 3\n# the end",
            functions=FUNCTIONS,
            period="50",
        ),
        sub(
            2,
            1,
            state(1, "left", 'side = "left"', initial=True),
            state(2, "right", 'side = "right"'),
            transition(1, 1, 2, "100", type="time", name="other"),
            variables='side = ""',
        ),
        libraries=("math", "time", "random"),
        head="<description>Patrol until tired.</description>",
    ),
    Path("patrol.xml"),
    Diagnostics(),
)
assert PATROL is not None
DOCUMENT = write_document(PATROL)


STATE = """\
    <state initial="false" id="{id}">
      <posx>500</posx>
      <posy>100</posy>
      <name>{name}</name>
      <idSubautomataSon>0</idSubautomataSon>
      <code>added = 1
# added</code>
    </state>
"""
TIRED = """\
    <transition id="1">
      <posx>0</posx>
      <posy>0</posy>
      <origin>1</origin>
      <destiny>2</destiny>
      <transcode></transcode>
      <name>tired</name>
"""
OTHER = TIRED.replace("tired", "other")
REST = "<name>rest</name>\n      <idSubautomataSon>0</idSubautomataSon>\n      <code>"
LATER = """\
    <transition id="2">
      <posx>0</posx>
      <posy>0</posy>
      <origin>2</origin>
      <destiny>3</destiny>
      <transcode>steps -= 1</transcode>
      <name>later</name>
      <trans type="time">500</trans>
    </transition>
"""

CHANGES = [
    (LATER, f"    <!-- later -->\n{LATER}"),
    ("<code>steps += 1\n", "<code># go\nsteps += 1\n"),
    ("self.log.info(text)<", "self.log.info(text)\n    # far<"),
    ("import math\n'''", "import math\nimport os\n'''"),
    ("<posx>0</posx>", "<posx>7</posx>"),
    (REST, f"{REST}rested = 1"),
    ("<name>sleep</name>", "<name>dream</name>\n      <final>true</final>"),
    ("# sleep\nsteps = 0", "# sleep\nsteps = 0\n# deep"),
    ("steps = 1<", "steps = 1\nsteps += 0<"),
    (TIRED, STATE.format(id=9, name="added") + TIRED),
    ("steps &gt; limit</trans>", "steps &gt; limit and\n  True</trans>"),
    ("<transcode>steps -= 1", "<transcode># now\nsteps -= 1"),
    (">500</trans>\n    </transition>\n    <iteration", ">700</trans>\n    </transition>\n    <iteration"),
    ("<variables>steps", "<variables>count = 0\nsteps"),
    ("# the end<", "# the end\nlast = 0<"),
    ("    return number / 2", "    # half\n    return number / 2"),
    ("def twice", "def nothing(self):\n    pass\n\ndef twice"),
    ("    return number * 3", "    # thrice\n    return number * 3"),
    ('<code>side = "left"', '<code># left\nside = "left"'),
    (
        "<posx>0</posx>\n      <posy>0</posy>\n      <name>right",
        "<posx>8</posx>\n      <posy>9</posy>\n      <name>right",
    ),
    (OTHER, STATE.format(id=3, name="middle") + OTHER),
    ("    <lib>math</lib>\n", "    <lib>ast</lib>\n    <lib>math</lib>\n"),
    ("    <lib>random</lib>\n", "    <lib>random</lib>\n    <lib>string</lib>\n"),
]
"""Changes of the document, of which neighbors merge."""


def changed(*changes: tuple[str, str]) -> str:
    """Return the document with changes, each of the first text that it is for."""
    text = DOCUMENT
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    return text


def component_of(text: str, folder: Path) -> str:
    """Return the component of a document."""
    document = folder / "patrol.xml"
    document.write_text(text, encoding="utf-8")
    made = compile_document(document, None, diagnostics := Diagnostics())
    assert made is not None, diagnostics.render()
    return made[0].text


def merged(base: str, ours: str, theirs: str, folder: Path) -> str:
    """Return what Git makes of two changes of a file, with marks where they conflict."""
    texts = {"ours": ours, "base": base, "theirs": theirs}
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    command = ["git", "merge-file", "--stdout", *texts]
    return subprocess.run(
        command, cwd=folder, capture_output=True, text=True, timeout=RUN_LIMIT, check=False
    ).stdout


def lines_of(component: Path) -> list[tuple[str, str]]:
    """Return each line of code in a component, and the one of the document to which it leads."""
    text = component.read_text("utf-8")
    made, written = text.split("\n"), component.with_suffix(".xml").read_text("utf-8").split("\n")
    source = read_source(text)
    lines = [line for code in source.codes for line in range(code.first, code.last + 1)]
    places = [Line(str(component), line, source).in_document for line in lines]
    return [
        (made[line - 1].strip(), written[int(place.removeprefix("patrol.xml:")) - 1])
        for line, place in zip(lines, places, strict=True)
    ]


def test_two_changes_that_merge_in_the_document_merge_in_the_component(tmp_path: Path) -> None:
    base = component_of(DOCUMENT, tmp_path)
    documents = [changed(change) for change in CHANGES]
    components = [component_of(document, tmp_path) for document in documents]
    neighbors = [(one, one + 1) for one in range(len(CHANGES) - 1)]
    for one, other in [*neighbors, *((one, one + 2) for one in range(len(CHANGES) - 2))]:
        document = merged(DOCUMENT, documents[one], documents[other], tmp_path)
        assert "<<<<<<<" not in document, "these changes are too close"
        made = merged(base, components[one], components[other], tmp_path)
        assert made == component_of(document, tmp_path), (CHANGES[one], CHANGES[other])


def test_removed_elements_change_only_their_own_lines(tmp_path: Path) -> None:
    base = component_of(DOCUMENT, tmp_path)
    ours, theirs = DOCUMENT.replace(LATER, ""), changed(("<name>tired</name>", "<name>weary</name>"))
    without = component_of(ours, tmp_path)
    made = merged(base, without, component_of(theirs, tmp_path), tmp_path)
    assert made == component_of(merged(DOCUMENT, ours, theirs, tmp_path), tmp_path)
    changes = difflib.ndiff(base.split("\n"), without.split("\n"))
    assert [line for line in changes if line[0] == "+"] == []


def test_branches_merge_and_the_merged_component_is_that_of_the_merged_document(tmp_path: Path) -> None:
    def git(*arguments: str) -> None:
        identity = ("-c", "user.name=A", "-c", "user.email=a@b", "-c", "init.defaultBranch=main")
        environment = {**os.environ, "GIT_CONFIG_GLOBAL": os.devnull, "GIT_CONFIG_SYSTEM": os.devnull}
        command = ["git", *identity, *arguments]
        subprocess.run(
            command, cwd=tmp_path, env=environment, capture_output=True, timeout=RUN_LIMIT, check=True
        )

    def commit(text: str) -> None:
        (tmp_path / "patrol.xml").write_text(text, encoding="utf-8")
        assert codegen("patrol.xml", cwd=tmp_path).returncode == 0
        git("add", ".")
        git("commit", "-m", "change")

    git("init")
    commit(DOCUMENT)
    git("checkout", "-b", "other")
    commit(changed(*CHANGES[::2]))
    git("checkout", "main")
    commit(changed(*CHANGES[1::2]))
    git("merge", "other")
    checked = codegen("--check", "patrol.xml", cwd=tmp_path)
    assert checked.returncode == 0, checked.stdout
    found = lines_of(tmp_path / "patrol.py")
    assert len(found) > 40
    for made, written in found:
        code = html.escape(made.partition("  # <")[0].removeprefix("return "), quote=False)
        assert code.removeprefix("import ") in written
