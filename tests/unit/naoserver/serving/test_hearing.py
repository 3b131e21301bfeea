"""Sentences for a robot that has no ears."""

import pytest

from naoserver.errors import InvalidCommand
from naoserver.protocol.expression import LONGEST_SENTENCE, Hearing


def test_all_that_listen_hear_and_say_what_they_recognized():
    hearing = Hearing()
    assert hearing.hear("hello") == ""
    for understand in (str.lower, lambda _sentence: "", str.upper):
        hearing.listen(understand)
    assert hearing.hear("Hello") == "hello, HELLO"


@pytest.mark.parametrize("sentence", ["", "  ", "a" * (LONGEST_SENTENCE + 1)])
def test_what_is_no_sentence_reaches_nobody(sentence):
    hearing = Hearing()
    hearing.listen(lambda _sentence: pytest.fail("it was heard"))
    with pytest.raises(InvalidCommand, match="text"):
        hearing.hear(sentence)
