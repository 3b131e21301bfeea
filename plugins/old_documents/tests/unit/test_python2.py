"""Python 2 is reported with its line, and converted if there is no other error; nothing else changes."""

from __future__ import annotations

import sys
import textwrap
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from codegen.diagnostics import Diagnostics
from codegen.hfsm import compile_document, parse_document
from codegen.hfsm.code.text import parse_piece
from tests.support.any_text import any_text
from tests.support.documents import document, state, sub
from tests.support.examples import examples
from visualhfsm_old_documents._languages import is_mostly_cpp
from visualhfsm_old_documents._modernize import modernize
from visualhfsm_old_documents._python2 import fix_python2

FIXED = [
    ("print x", "print(x)"),
    ("print", "print()"),
    ('print"a"', 'print("a")'),
    ("print x, y  # both", "print(x, y)  # both"),
    ('print "a",', "print(\"a\", end=' ')"),
    ('print ("a %s") % b', 'print(("a %s") % b)'),
    ("print (1, 2), 3", "print((1, 2), 3)"),
    ("print not x", "print(not x)"),
    ("print -x", "print(-x)"),
    ("print lambda a: a", "print(lambda a: a)"),
    ("print >>f", "print(file=f)"),
    ("print >>sys.stderr, 'a', b,", "print('a', b, end=' ', file=sys.stderr)"),
    ("print '%d' % (a,\n  b)", "print('%d' % (a,\n  b))"),
    ("print '''a\nb''', c", "print('''a\nb''', c)"),
    ("if a: print b; print c\nelse: print {1: 2}[1:]", "if a: print(b); print(c)\nelse: print({1: 2}[1:])"),
    ("    print 1\n    print 2\n", "    print(1)\n    print(2)\n"),
    (
        "try:\n  f()\nexcept (A, B), e:\n  raise\nexcept C, d: pass",
        "try:\n  f()\nexcept (A, B) as e:\n  raise\nexcept C as d: pass",
    ),
    ('raise X, "no"', 'raise X("no")'),
    ("raise X, (1, 2)", "raise X(1, 2)"),
    ("raise a.X, b, c", "raise a.X(b).with_traceback(c)"),
    ('exec "a = 1"', 'exec("a = 1")'),
    ("exec code in a, b", "exec(code, a, b)"),
    ("x = `a` + `b + c`", "x = repr(a) + repr(b + c)"),
    ("print `a`", "print(repr(a))"),
    ("a <> b", "a != b"),
    ("return self.x <> None", "return self.x != None"),
    ("x = 0777 + 10L + 0xFFL + 0", "x = 0o777 + 10 + 0xFF + 0"),
    ("d.has_key(k)", "k in d"),
    ("if not self.a[1].f(x).has_key(k + 1): pass", "if k + 1 not in self.a[1].f(x): pass"),
    ("for i in xrange(3): pass", "for i in range(3): pass"),
    ("isinstance(x, (unicode, long))", "isinstance(x, (str, int))"),
    ("m = map(f, x)[0]; print m", "m = list(map(f, x))[0]; print(m)"),
    ("k = d.keys()[0]; print k", "k = list(d.keys())[0]; print(k)"),
    ("n = x.next() + sys.maxint\nprint n", "n = next(x) + sys.maxsize\nprint(n)"),
    ("for k, v in d.iteritems(): pass", "for k, v in d.items(): pass"),
    ("import Queue\nfrom StringIO import StringIO", "import queue as Queue\nfrom io import StringIO"),
    ("if x:\n        a = 1\n\tb = 2\n", "if x:\n        a = 1\n        b = 2\n"),
    ("print x\r\nprint y\r\n", "print(x)\r\nprint(y)\r\n"),
]

KEPT = [
    "",
    "  \n",
    "print(x)",
    "print(x) if x else None",
    "print (x, y)",
    "f(print)",
    "self.print_it(1)",
    "x = 'print y'  # print z",
    "'''\nprint x\n'''",
    "long = 3\nx = long",
    "def f(unicode):\n    return unicode",
    "for long in x: long()",
    "f(long=1)",
    "x.unicode()",
    "x = 1 if a <= b else 0.5e10",
    "a[1:2] = {x: lambda: 3}",
    "exec('x')",
    "raise X('a, b')",
    "if x:\n\ta = 1\nelse:\n\tb = 2",
    "x = 0o777 + 0x10 + 0b1 + 00",
    "print_function = 1",
]

BROKEN = [
    "print hello world",
    "x = ur'\\u00e9'",
    "if x print y",
    "`a",
    "print x y",
    "def f(a, (b, c)): print a",
    "raise X, ",
    "(" * 200 + "print x",
]


@pytest.mark.parametrize(("old", "new"), FIXED)
def test_python_2_is_fixed(old: str, new: str) -> None:
    assert fix_python2(old) == new
    assert fix_python2(new) == new
    assert parse_piece(new) is not None


@pytest.mark.parametrize("code", KEPT)
def test_python_3_stays_as_it_is(code: str) -> None:
    assert fix_python2(code) == code


@pytest.mark.parametrize("code", BROKEN)
def test_what_more_is_wrong_with_is_not_fixed(code: str) -> None:
    assert fix_python2(code) is None


def test_each_line_is_reported_where_it_stands() -> None:
    diagnostics = Diagnostics()
    path = Path("old.xml")
    parsed = parse_document(_document("a = 1\nif a &lt;&gt; 2:\n    print `a`\n"), path, diagnostics)
    assert parsed is not None
    assert modernize(parsed, path, diagnostics, fixes=False) == parsed
    found = [each for each in diagnostics if each.location.line < 6]
    assert [(each.code, each.location.line, each.location.column) for each in found] == [
        ("W506", 4, 6),
        ("W506", 5, 5),
    ]
    assert found[0].message == "Python 2: `if a <> 2:` is `if a != 2:` in Python 3"


def test_without_fissix_the_command_that_installs_it_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    from visualhfsm_old_documents import _python2 as python2

    python2._tool.cache_clear()
    monkeypatch.setitem(sys.modules, "fissix.refactor", None)
    with pytest.raises(ModuleNotFoundError, match=r"pip install 'visualhfsm\[python2\]'"):
        fix_python2("print x")
    path, diagnostics = Path("old.xml"), Diagnostics()
    parsed = parse_document(_document("print 1"), path, diagnostics)
    assert parsed is not None
    modernize(parsed, path, diagnostics, fixes=False)
    assert [each.code for each in diagnostics] == ["W506"]
    assert "visualhfsm[python2]" in diagnostics.render()
    assert not is_mostly_cpp(parsed)


# Statements of Python 3 that say the same in Python 2, and how Python 2 may write them.
_names = st.sampled_from(["a", "b", "self.x", "f(1)", "d['k']", '"text, more"', "(1, 2)", "[x for x in y]"])
_lines = st.one_of(
    st.builds(lambda a: (f"print {a}", f"print({a})"), _names.filter(lambda name: not name.startswith("("))),
    st.builds(lambda a, b: (f"x = {a} <> {b}", f"x = {a} != {b}"), _names, _names),
    st.builds(lambda a: (f"x = `{a}`", f"x = repr({a})"), _names),
    st.builds(lambda a, b: (f"y = {a}; z = {b}  # print it",) * 2, _names, _names),
    st.builds(lambda a: (f"raise E, {a}", f"raise E({a})"), _names.filter(lambda name: name != "(1, 2)")),
    st.just(("if a: pass\nelse:\n\tb = 1\n",) * 2),
    st.just(("s = '''\nprint a <> b\n'''",) * 2),
)


@settings(max_examples=examples(25), deadline=None)
@given(st.lists(_lines, max_size=6))
def test_any_mixture_is_fixed_and_the_rest_stays(lines: list[tuple[str, str]]) -> None:
    old, new = ("\n".join(side) for side in (zip(*lines, strict=True) if lines else ((), ())))
    assert fix_python2(old) == new


@settings(max_examples=examples(25), deadline=None)
@given(
    st.text(st.sampled_from("print exec raise `<>(),'\"\n\t:;#\\ulrL07x%$"), max_size=60)
    | any_text(max_size=60)
)
def test_no_code_does_more_than_stay_as_it_is(code: str) -> None:
    fixed = fix_python2(code)
    assert fixed is None or parse_piece(fixed) is not None
    assert fixed is None or fixed.count("\n") == code.count("\n")


def test_a_name_that_other_code_of_the_document_gives_a_meaning_stays() -> None:
    text = _document("x = long", condition="unicode(x)").replace(
        "</SubAutomata>", "<variables>long = 3</variables></SubAutomata>"
    )
    document = parse_document(text, Path("old.xml"), Diagnostics())
    assert document is not None
    (automaton,) = modernize(document, Path("old.xml"), Diagnostics(), fixes=True).automata
    assert automaton.states[0].code.text == "x = long"
    assert automaton.transitions[0].trigger.text == "str(x)"


def test_the_projects_own_code_is_python_3() -> None:
    for path in Path("codegen/hfsm/code").rglob("*.py"):
        code = path.read_text("utf-8")
        assert fix_python2(code) == code, path


def _document(code: str, condition: str = "True") -> str:
    return textwrap.dedent(f"""\
        <VisualHFSM><SubAutomata id="1" idFather="0">
        <state id="1"><name>s</name>
        <code>{code}</code></state>
        <transition id="1"><origin>1</origin><destiny>1</destiny>
        <trans type="condition">{condition}</trans></transition>
        </SubAutomata><libraries><lib>Queue</lib><lib>math</lib></libraries></VisualHFSM>
        """)


def test_a_document_is_fixed_piece_by_piece() -> None:
    path = Path("old.xml")
    diagnostics = Diagnostics()
    document = parse_document(_document("print 1", "a &lt;&gt; b or print x"), path, diagnostics)
    assert document is not None
    fixed = modernize(document, path, diagnostics, fixes=True)
    assert fixed.automata[0].states[0].code.text == "print(1)"
    # More is wrong with the condition: it stays, and what is wrong is reported.
    assert fixed.automata[0].transitions[0].trigger.text == "a <> b or print x"
    assert [library.name.text for library in fixed.libraries] == ["queue as Queue", "math"]
    assert [(found.code, found.location.line, found.location.column) for found in diagnostics] == [
        ("N503", 3, 7),
        ("W506", 5, 27),
        ("N503", 6, 31),
    ]


def test_a_division_in_python_2_is_pointed_at() -> None:
    diagnostics = Diagnostics()
    document = parse_document(_document("x = 1 / 2\nprint 3 / 4"), Path("old.xml"), diagnostics)
    assert document is not None
    modernize(document, Path("old.xml"), diagnostics, fixes=True)
    found = next(found for found in diagnostics if found.location.line == 4)
    assert [(note.location.line, note.location.column) for note in found.notes if note.location] == [
        (3, 21),
        (4, 9),
    ]


@pytest.mark.parametrize(
    ("code", "is_cpp"),
    [
        ("", False),
        ("walk to the ball", False),
        ("ball", False),
        ("a &lt; b", False),
        ("self.motors.setV(0)", False),
        ("print 'a'", False),
        ("for i in range(3): print i", False),
        ("stop()", False),
        ("stop();", True),
        ("int i;", True),
        ("control-&gt;mprx-&gt;setW(20);", True),
        ("#include &lt;math.h&gt;", True),
        ("// nothing yet", True),
        ("/* nothing yet */", True),
        ("std::cout &lt;&lt; 1 &lt;&lt; std::endl;", True),
        ("if (x) {\n  y();\n}", True),
        ("x = 1  # int y; { }", False),
        ("x = 'a-&gt;b();'", False),
        ("def f(x) -&gt; int: return x", False),
        ("if x:\n  y = `z", False),
    ],
)
def test_code_shows_whether_it_is_cpp(code: str, is_cpp: bool) -> None:
    document = parse_document(_document(code, condition="a"), Path("old.xml"), Diagnostics())
    assert document is not None
    assert is_mostly_cpp(document) == is_cpp


def test_the_more_of_two_languages_counts() -> None:
    text = _document("int i;\nfloat f;\nbool b;", "not self.near()")
    document = parse_document(text, Path("old.xml"), Diagnostics())
    assert document is not None
    assert is_mostly_cpp(document)
    text = _document("int i;", "not self.near() \\\n or self.far() \\\n or self.lost()")
    document = parse_document(text, Path("old.xml"), Diagnostics())
    assert document is not None
    assert not is_mostly_cpp(document)


def test_a_document_that_says_its_language_keeps_it() -> None:
    text = _document("int i;").replace("<SubAutomata id", "<language>Java</language><SubAutomata id")
    document = parse_document(text, Path("old.xml"), Diagnostics())
    assert document is not None
    assert document.language.text == "Java"


@pytest.mark.parametrize(
    ("code", "has_hint"), [("print x", True), ("print x; y = = 1", False), ("yield x", False)]
)
def test_generation_says_where_fixing_is_all_that_is_needed(
    tmp_path: Path, code: str, has_hint: bool
) -> None:
    path = tmp_path / "old.xml"
    path.write_text(
        document(sub(1, 0, state(1, "a", code, initial=True), variables="x = 1")), encoding="utf-8"
    )
    diagnostics = Diagnostics()
    assert compile_document(path, None, diagnostics) is None
    (error,) = diagnostics.errors
    notes = ["this is Python 2: `visualhfsm convert --fix-python2` fixes it"]
    assert [note.message for note in error.notes] == (notes if has_hint else [])
