from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from codegen._idl.lexer import (
    LiteralError,
    Source,
    Token,
    TokenKind,
    parse_float,
    parse_integer,
    parse_string,
)
from tests.support.slice_texts import slice_like_texts


def tokens(text: str) -> list[Token]:
    return Source(Path("a.idl"), text).tokens


def shapes(text: str) -> list[tuple[TokenKind, str]]:
    return [(token.kind, token.text) for token in tokens(text)[:-1]]


def test_words_marks_and_literals_are_distinguished() -> None:
    assert shapes('struct S { ::a::B x = -5; } "s\\"t" 1.5e-3f 0x1F') == [
        (TokenKind.KEYWORD, "struct"),
        (TokenKind.NAME, "S"),
        (TokenKind.PUNCTUATION, "{"),
        (TokenKind.PUNCTUATION, "::"),
        (TokenKind.NAME, "a"),
        (TokenKind.PUNCTUATION, "::"),
        (TokenKind.NAME, "B"),
        (TokenKind.NAME, "x"),
        (TokenKind.PUNCTUATION, "="),
        (TokenKind.INTEGER, "-5"),
        (TokenKind.PUNCTUATION, ";"),
        (TokenKind.PUNCTUATION, "}"),
        (TokenKind.STRING, '"s\\"t"'),
        (TokenKind.FLOAT, "1.5e-3f"),
        (TokenKind.INTEGER, "0x1F"),
    ]


def test_a_backslash_makes_a_keyword_a_name() -> None:
    (token, _) = tokens(r"\module")
    assert (token.kind, token.text, token.escaped) == (TokenKind.NAME, "module", True)
    assert token.location.length == len(r"\module")


def test_doc_comments_go_to_the_token_behind_or_before_them() -> None:
    found = tokens(
        "/** of a */ a; /**< of the semicolon */ b /* plain */ c /// of d\n//! too\nd //// plain\n e"
    )
    assert {token.text: token.doc for token in found if token.doc} == {"a": " of a ", "d": " of d\n too"}
    assert {token.text: token.trailing_doc for token in found if token.trailing_doc} == {
        ";": " of the semicolon "
    }


@pytest.mark.parametrize("text", ["3f", "0X10", "12abc", "0xG", "$", "é", "'", "a # b"])
def test_what_slice_does_not_know_is_one_invalid_token(text: str) -> None:
    assert [token.kind for token in tokens(text)].count(TokenKind.INVALID) == 1


@pytest.mark.parametrize("text", ['"abc', '"abc\n"'[:4], "/* abc", "/*/"])
def test_what_has_no_end_is_reported(text: str) -> None:
    assert tokens(text)[0].kind is TokenKind.UNTERMINATED


def test_a_directive_reaches_over_continued_lines_and_comments() -> None:
    found = tokens("  #define A \\\n  5 /* two\nlines */ 6\n/* c */ # define B")
    assert [token.kind for token in found] == [TokenKind.DIRECTIVE, TokenKind.DIRECTIVE, TokenKind.END]


@given(slice_like_texts())
def test_tokens_stand_in_order_where_they_say(text: str) -> None:
    last = 0
    for token in tokens(text)[:-1]:
        assert token.offset >= last
        begin = token.offset + token.escaped
        if token.text != "#":
            assert text[begin : begin + len(token.text)] == token.text
        last = begin + len(token.text)
        line = text.split("\n")[token.location.line - 1]
        assert line[token.location.column - 1 :].startswith(text[token.offset])


@given(st.integers(-(2**70), 2**70))
def test_integers_are_read_in_every_base(value: int) -> None:
    sign = "-" if value < 0 else ""
    assert parse_integer(str(value)) == value
    assert parse_integer(f"{sign}0x{abs(value):x}") == value
    assert parse_integer(f"{sign}0{abs(value):o}") == value


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_floats_are_read_exactly(value: float) -> None:
    assert parse_float(repr(value)) == value


@given(st.text(st.characters(exclude_categories=["Cs", "Cc"])))
def test_strings_survive_escaping(value: str) -> None:
    escaped = value.replace("\\", "\\\\").replace('"', '\\"')
    assert parse_string(f'"{escaped}"') == (value, [])
    in_octal = "".join(f"\\{byte:03o}" for byte in value.encode())
    assert parse_string(f'"{in_octal}"') == (value, [])


@pytest.mark.parametrize("text", [r'"\400"', r'"\ud800"', r'"\U00110000"', r'"\u12"', r'"\x"'])
def test_escapes_that_are_no_character_are_refused(text: str) -> None:
    with pytest.raises(LiteralError):
        parse_string(text)


def test_an_unknown_escape_stands_for_itself() -> None:
    assert parse_string(r'"\q\n"') == ("\\q\n", ["\\q"])


@pytest.mark.parametrize("text", ["09", "9" * 401])
def test_integers_without_a_value_are_refused(text: str) -> None:
    with pytest.raises(LiteralError):
        parse_integer(text)


def test_a_float_beyond_double_is_refused() -> None:
    with pytest.raises(LiteralError):
        parse_float("1e999")
