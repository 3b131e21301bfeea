from __future__ import annotations

from pathlib import Path
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from codegen.diagnostics import Diagnostics
from codegen.idl import ast
from codegen.idl.formatter import FormattingError, format_file, format_source, words_of
from codegen.idl.lexer import Kind, Source
from codegen.idl.loading import load_definitions
from codegen.idl.schema import canonical_definition
from tests.support.examples import examples
from tests.support.slice_grammar import slice_files
from tests.support.slice_texts import slice_like_texts

ROOT = Path(__file__).parents[2]
EVERYTHING = """\
[["python:package:api"]]

#ifndef EVERYTHING
#define EVERYTHING

// A remark on its own.

/** What a module says. */
module m {

  const int most = 0x1F;
  const string text = "a \\"text\\""; // a remark behind

  interface Later;

  sequence<byte> Bytes;
  dictionary<string, Bytes> Files;

  enum Color { Red, Green = 5, Blue };

  /** With remarks. */
  enum Shape {
    /** Four sides. */
    Square,
    Circle // none
  };

  struct Point {
    double x; ///< in m
    double y;

    /* Not
     * more. */
    Color color;
  };

  class Node {
    string \\class;
  };

  exception Bad {
    string why;
  };

  exception Worse extends Bad {};

#ifdef MORE
  struct Extra {
    int a;
  };

#else
  struct Other {
    m::Point a;
  };

#endif

  interface Device {
    ["stream"] idempotent Point where();
    ["stop"] idempotent void halt();
    void longOne(string first, string second, out ::m::Point third)
      throws ::m::Bad, Worse;
    void veryLongOne(
      string first,
      // Behind the first.
      string second,
      out Bytes third
    ) throws Bad;
  };

  interface Later extends Device {};

};

#endif
"""


def formatted(text: str) -> str:
    return format_source(Source(Path("test.idl"), text))


def forms(path: Path) -> dict[str, str]:
    """Return the canonical definitions of the interfaces of a file."""
    diagnostics = Diagnostics()
    found = load_definitions([path], [], diagnostics)
    assert not diagnostics.has_errors, diagnostics.render()
    interfaces = (each for each in found.values() if isinstance(each, ast.Interface))
    return {interface.scoped: canonical_definition(interface) for interface in interfaces}


@pytest.mark.parametrize("path", sorted(ROOT.glob("interfaces/*.idl")), ids=lambda path: path.name)
def test_the_interfaces_of_the_project_are_formatted(path: Path) -> None:
    assert formatted(path.read_text()) == path.read_text()


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", ""),
        ("module m{struct S{int a;};};", "module m {\n\n  struct S {\n    int a;\n  };\n\n};\n"),
        ("module m {}", "module m {};\n"),
        ("module m{interface I{}}", "module m {\n\n  interface I {};\n\n};\n"),
        (
            "module m\n{\n  enum E { a,\n b = 3, };\n};",
            "module m {\n\n  enum E { a, b = 3 };\n\n};\n",
        ),
        (
            "module m { enum E { , a // first\n , b /** two */ } }",
            "module m {\n\n  enum E {\n    a, // first\n    b /** two */\n  };\n\n};\n",
        ),
        (
            "module m { struct S { int a; } ; struct T { int b; /**< last */ } };",
            "module m {\n\n  struct S {\n    int a;\n  };\n\n  struct T {\n    int b; /**< last */\n  };\n\n};\n",
        ),
        (
            "module m { struct S // why\n { ::m :: S \\int ;\n\n\n int b\n; /* end */ }; };",
            "module m {\n\n  struct S { // why\n    ::m::S \\int;\n\n    int b; /* end */\n  };\n\n};\n",
        ),
        (
            "module m { interface I { void f( /* none */ ) ; void g(int a , out T * b)throws X , Y; }; };",
            "module m {\n\n  interface I {\n    void f(/* none */);\n    void g(int a, out T* b) throws X, Y;\n  };\n\n};\n",
        ),
        (
            "module m { interface I { void f(int a, // first\n int b); }; };",
            "module m {\n\n  interface I {\n    void f(\n      int a, // first\n      int b\n    );\n  };\n\n};\n",
        ),
        (
            "#ifndef A // guard\n#  define   A\nmodule m { interface I; interface J; }\n#endif // A\n",
            "#ifndef A // guard\n#define A\n\nmodule m {\n\n  interface I;\n  interface J;\n\n};\n\n#endif // A\n",
        ),
        (
            '[["a","b"]] ["x"]module m { ["y"] class C(5) extends D { optional( 1 )int a=-3; }; };',
            '[["a", "b"]]\n\n["x"] module m {\n\n  ["y"] class C(5) extends D {\n    optional(1) int a = -3;\n  };\n\n};\n',
        ),
        (
            "module m {\n      /*\n        kept\n          inside\n      */\n      // more\n  struct S { int a; };\n};",
            "module m {\n\n  /*\n     kept\n       inside\n   */\n  // more\n  struct S {\n    int a;\n  };\n\n};\n",
        ),
    ],
)  # fmt: skip
def test_a_file_is_laid_out(text: str, expected: str) -> None:
    assert formatted(text) == expected
    assert formatted(expected) == expected


def test_a_canonical_file_stays_as_it_is() -> None:
    assert formatted(EVERYTHING).splitlines() == [
        # The parts that fit on one line are joined; everything else stands as it was.
        *EVERYTHING.replace("third)\n      throws", "third) throws").splitlines()
    ]


def test_a_file_whose_words_would_not_survive_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("codegen.idl.formatter._statement_lines", lambda words, ending, indent: [ending])
    with pytest.raises(FormattingError, match=r"test\.idl"):
        formatted("module m {};")


GAPS = (
    " ",
    "\n",
    "\n\n\n",
    "\t ",
    " /* c */ ",
    " // c\n",
    "\n  // own\n",
    "\n/* a\n   b\n */\n",
    " /** d */\n",
    " ///< e\n",
)


def respaced(text: str, random: Random) -> str:
    """Return a text with other spaces and additional comments between its words."""
    parts: list[str] = []
    words = words_of(Source(Path("test.idl"), text))
    for word, following in zip(words, [*words[1:], words[0]], strict=True):
        if word.kind is Kind.DIRECTIVE:
            parts.append(f"\n{word.text}\n")
        elif word.text.startswith("//"):
            parts.append(f"{word.text}\n")
        elif word.text == "::" or (word.kind is Kind.NAME and following.text == "::"):
            parts.append(word.text)  # no space may stand in a scoped name
        else:
            parts += [word.text, random.choice(GAPS), random.choice(("", "", *GAPS))]
    return "".join(parts)


@settings(max_examples=examples(60), deadline=None)
@given(seed=st.integers(0, 1 << 32))
def test_only_spaces_change_and_a_second_time_nothing(
    tmp_path_factory: pytest.TempPathFactory, seed: int
) -> None:
    text = respaced(EVERYTHING, Random(seed))
    after = formatted(text)
    assert formatted(after) == after
    path = tmp_path_factory.getbasetemp() / "before.idl"
    path.write_text(text)
    before = forms(path)
    path.write_text(after)
    assert forms(path) == before
    assert set(before) == {"::m::Device", "::m::Later"}


def after_formatting(path: Path) -> str | None:
    """Return what `codegen fmt` would make of a file, or None when it would not touch it."""
    try:
        return format_file(path, Diagnostics())
    except FormattingError:
        return None


@settings(max_examples=100, deadline=None)
@given(text=slice_files())
def test_generated_files_keep_their_meaning(tmp_path_factory: pytest.TempPathFactory, text: str) -> None:
    path = tmp_path_factory.getbasetemp() / "generated.idl"
    path.write_text(text)
    after = after_formatting(path)
    if after is None:
        return
    assert formatted(after) == after
    before = found_in(path)
    path.write_text(after)
    assert found_in(path) == before


def found_in(path: Path) -> tuple[list[str], dict[str, str]]:
    """Return the codes of what is wrong with a file, and the canonical forms of all that it defines."""
    diagnostics = Diagnostics()
    definitions = load_definitions([path], [], diagnostics)
    codes = sorted(found.code for found in diagnostics)
    if diagnostics.has_errors:
        return codes, {}
    return codes, {scoped: canonical_definition(each) for scoped, each in definitions.items()}


@settings(max_examples=100, deadline=None)
@given(text=slice_like_texts())
def test_any_text_is_laid_out_or_left_alone(tmp_path_factory: pytest.TempPathFactory, text: str) -> None:
    path = tmp_path_factory.getbasetemp() / "any.idl"
    path.write_bytes(text.encode("utf-8", "surrogatepass"))
    after = after_formatting(path)
    if after is not None:
        assert formatted(after) == after


def test_a_comment_without_an_end_is_reported(tmp_path: Path) -> None:
    path = tmp_path / "main.idl"
    path.write_text("module m {};\n/* never ends\n")
    diagnostics = Diagnostics()
    assert format_file(path, diagnostics) is None
    assert [(found.code, found.location.line) for found in diagnostics] == [("E003", 2)]
