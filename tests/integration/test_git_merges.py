"""Branches of a project merge with plain Git: the component where its document does, line by line."""

from __future__ import annotations

import subprocess
from itertools import combinations
from pathlib import Path

import pytest

from codegen.diagnostics import Diagnostics
from codegen.hfsm import compile_document
from tests.support.codegen_command import codegen
from tests.support.limits import RUN_LIMIT

DOCUMENT = """\
<?xml version="1.0" encoding="UTF-8"?>
<VisualHFSM>
  <description>Patrol until tired.</description>
  <SubAutomata id="1" idFather="0">
    <state initial="true" id="1">
      <posx>100</posx>
      <posy>100</posy>
      <name>walk</name>
      <idSubautomataSon>2</idSubautomataSon>
      <code>steps += 1
if steps &gt; limit:
    text = '''
# &lt;/code 1.1&gt;
import math
'''
    self.log.info(text)</code>
    </state>
    <state initial="false" id="2">
      <posx>200</posx>
      <posy>100</posy>
      <name>rest</name>
      <idSubautomataSon>0</idSubautomataSon>
    </state>
    <state initial="false" id="3">
      <posx>300</posx>
      <posy>100</posy>
      <name>sleep</name>
      <idSubautomataSon>0</idSubautomataSon>
      <code># sleep
steps = 0</code>
    </state>
    <state initial="false" id="4">
      <posx>400</posx>
      <posy>100</posy>
      <name>wake</name>
      <idSubautomataSon>0</idSubautomataSon>
      <code>steps = 1</code>
    </state>
    <transition id="1">
      <posx>150</posx>
      <posy>100</posy>
      <origin>1</origin>
      <destiny>2</destiny>
      <transcode></transcode>
      <name>tired</name>
      <trans type="condition">steps &gt; limit</trans>
    </transition>
    <transition id="2">
      <posx>250</posx>
      <posy>100</posy>
      <origin>2</origin>
      <destiny>3</destiny>
      <transcode>steps -= 1</transcode>
      <name>later</name>
      <trans type="time">500</trans>
    </transition>
    <transition id="3">
      <posx>350</posx>
      <posy>100</posy>
      <origin>3</origin>
      <destiny>4</destiny>
      <transcode></transcode>
      <name>wake</name>
      <trans type="time">500</trans>
    </transition>
    <iteration_time>50</iteration_time>
    <variables>steps = 0
limit = 3
# the end</variables>
    <functions>def half(self, number):
    return number / 2

def twice(self, number):
    return number * 2

def thrice(self, number):
    return number * 3</functions>
  </SubAutomata>
  <SubAutomata id="2" idFather="1">
    <state initial="true" id="1">
      <posx>100</posx>
      <posy>100</posy>
      <name>left</name>
      <idSubautomataSon>0</idSubautomataSon>
      <code>side = "left"</code>
    </state>
    <state initial="false" id="2">
      <posx>200</posx>
      <posy>100</posy>
      <name>right</name>
      <idSubautomataSon>0</idSubautomataSon>
      <code>side = "right"</code>
    </state>
    <transition id="1">
      <posx>150</posx>
      <posy>100</posy>
      <origin>1</origin>
      <destiny>2</destiny>
      <transcode></transcode>
      <name>other</name>
      <trans type="time">100</trans>
    </transition>
    <iteration_time>100</iteration_time>
    <variables>side = ""</variables>
    <functions></functions>
  </SubAutomata>
  <libraries>
    <lib>math</lib>
    <lib>time</lib>
    <lib>random</lib>
  </libraries>
</VisualHFSM>
"""


def state(number: int, name: str, code: str = "pass") -> str:
    """Return a state as the editor writes it."""
    return f"""\
    <state initial="false" id="{number}">
      <posx>500</posx>
      <posy>100</posy>
      <name>{name}</name>
      <idSubautomataSon>0</idSubautomataSon>
      <code>{code}</code>
    </state>
"""


def without(begin: str, end: str) -> tuple[str, str]:
    """Return the change that removes what begins with one text and ends with another."""
    start = DOCUMENT.index(begin)
    return DOCUMENT[start : DOCUMENT.index(end, start) + len(end)], ""


CHANGES = {
    "first line of walk": ("<code>steps += 1\n", "<code># go\nsteps += 1\n"),
    "last line of walk": ("self.log.info(text)<", "self.log.info(text)\n    # far<"),
    "line inside a string": ("import math\n'''", "import math\nimport os\n'''"),
    "first code of rest": (
        "<name>rest</name>\n      <idSubautomataSon>0</idSubautomataSon>\n",
        "<name>rest</name>\n      <idSubautomataSon>0</idSubautomataSon>\n      <code>rested = 1</code>\n",
    ),
    "line in sleep": ("# sleep\nsteps = 0", "# sleep\nsteps = 0\n# deep"),
    "line in wake": ("<code>steps = 1", "<code>steps = 1\nsteps += 0"),
    "walk moved": ("<posx>100</posx>\n      <posy>100</posy>\n      <name>walk", "<posx>7</posx>\n      <posy>8</posy>\n      <name>walk"),
    "sleep renamed": ("<name>sleep</name>", "<name>dream</name>"),
    "rest is final": ('<state initial="false" id="2">\n      <posx>200</posx>\n      <posy>100</posy>\n      <name>rest', '<state initial="false" id="2">\n      <posx>200</posx>\n      <posy>100</posy>\n      <final>true</final>\n      <name>rest'),
    "guard of tired": ("steps &gt; limit</trans>", "steps &gt; limit + 1</trans>"),
    "longer guard of tired": ("<trans type=\"condition\">", "<trans type=\"condition\">True and\n  "),
    "code of later": ("<transcode>steps -= 1", "<transcode># now\nsteps -= 1"),
    "state added": ('    <transition id="1">\n      <posx>150</posx>\n      <posy>100</posy>\n      <origin>1</origin>\n      <destiny>2</destiny>\n      <transcode></transcode>\n      <name>tired', state(9, "added", "steps = 9\n# added") + '    <transition id="1">\n      <posx>150</posx>\n      <posy>100</posy>\n      <origin>1</origin>\n      <destiny>2</destiny>\n      <transcode></transcode>\n      <name>tired'),
    "state added below": ('    <transition id="1">\n      <posx>150</posx>\n      <posy>100</posy>\n      <origin>1</origin>\n      <destiny>2</destiny>\n      <transcode></transcode>\n      <name>other', state(3, "middle") + '    <transition id="1">\n      <posx>150</posx>\n      <posy>100</posy>\n      <origin>1</origin>\n      <destiny>2</destiny>\n      <transcode></transcode>\n      <name>other'),
    "variable before": ("<variables>steps", "<variables>count = 0\nsteps"),
    "variable after": ("# the end<", "# the end\nlast = 0<"),
    "line in half": ("    return number / 2", "    # half\n    return number / 2"),
    "line in thrice": ("    return number * 3", "    # thrice\n    return number * 3"),
    "function added": ("def twice", "def nothing(self):\n    pass\n\ndef twice"),
    "line in left": ('<code>side = "left"', '<code># left\nside = "left"'),
    "right moved": ("<posx>200</posx>\n      <posy>100</posy>\n      <name>right", "<posx>7</posx>\n      <posy>8</posy>\n      <name>right"),
    "period": ("<iteration_time>50<", "<iteration_time>60<"),
    "library": ("    <lib>math</lib>\n", "    <lib>ast</lib>\n    <lib>math</lib>\n"),
    "library after": ("    <lib>random</lib>\n", "    <lib>random</lib>\n    <lib>string</lib>\n"),
}


def component_of(text: str, folder: Path) -> str:
    document = folder / "patrol.xml"
    document.write_text(text)
    (made,) = compile_document(document, None, diagnostics := Diagnostics()) or [None]
    assert made is not None, diagnostics.render()
    return made.text


def merged(base: str, ours: str, theirs: str, folder: Path) -> str | None:
    """Return what Git makes of two changes of a file, None for a conflict."""
    names = {"ours": ours, "base": base, "theirs": theirs}
    for name, text in names.items():
        (folder / name).write_text(text)
    command = ["git", "merge-file", "-p", *names]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=RUN_LIMIT)
    return done.stdout if done.returncode == 0 else None


def test_what_merges_in_the_document_merges_in_the_component(tmp_path: Path) -> None:
    base = component_of(DOCUMENT, tmp_path)
    documents = {}
    for name, (old, new) in CHANGES.items():
        assert DOCUMENT.count(old) == 1, name
        documents[name] = DOCUMENT.replace(old, new)
    components = {name: component_of(text, tmp_path) for name, text in documents.items()}
    tried = 0
    wrong=[]
    for one, other in combinations(CHANGES, 2):
        document = merged(DOCUMENT, documents[one], documents[other], tmp_path)
        if document is None:
            print("doc conflict", one, other)
            continue
        tried += 1
        component = merged(base, components[one], components[other], tmp_path)
        if component != component_of(document, tmp_path):
            wrong.append((one, other, component is None))
    print(tried)
    assert not wrong
