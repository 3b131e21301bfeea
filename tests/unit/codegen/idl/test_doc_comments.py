"""Doc comments of Slice become docstrings."""

from __future__ import annotations

from codegen._idl.doc_comments import parse_doc_comment


def test_tags_of_a_doc_comment_can_stand_in_one_line() -> None:
    doc = parse_doc_comment(
        " Move, ask a@return.org. @param p where to @return whether @throws Stuck if not "
    )
    assert doc.text == "Move, ask a@return.org."
    assert (doc.parameters, doc.returns, doc.throws) == ({"p": "where to"}, "whether", {"Stuck": "if not"})
