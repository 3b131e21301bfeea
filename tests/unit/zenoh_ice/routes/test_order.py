"""What a client and a server remember of calls, so that none is executed after a later one."""

from __future__ import annotations

import threading

from zenoh_ice.data.keys import Target
from zenoh_ice.data.wire import decode_attachment
from zenoh_ice.routes._given_up import GivenUpCalls, OwnCalls

HEAD, BODY = Target("nao", "Head"), Target("nao", "Body")


def test_calls_that_were_begun_count_until_each_has_ended() -> None:
    calls = OwnCalls("abc")
    calls.begin(HEAD, 1)
    calls.begin(HEAD, 2)
    calls.end(HEAD, 1)
    assert HEAD in calls.unanswered
    assert BODY not in calls.unanswered
    calls.end(HEAD, 2)
    assert HEAD not in calls.unanswered


def test_while_one_was_begun_none_of_another_thread_hides_it() -> None:
    calls = OwnCalls("abc")
    calls.begin(HEAD, 0)
    ended = threading.Event()

    def begin_and_end() -> None:
        while not ended.is_set():
            calls.begin(HEAD, 1)
            calls.end(HEAD, 1)

    other = threading.Thread(target=begin_and_end)
    other.start()
    try:
        assert all(HEAD in calls.unanswered for _ in range(20_000))
    finally:
        ended.set()
        other.join()


def test_a_server_hears_of_those_that_were_given_up_until_the_client_knows_that_it_did() -> None:
    calls, known = OwnCalls("abc"), GivenUpCalls()
    late = decode_attachment(calls.attach(HEAD, 1, "c0ffee", 2.0)[0])
    calls.give_up(HEAD, 1)
    attachment, named = calls.attach(HEAD, 2, "c0ffee", 2.0)
    assert named == (1,)
    assert calls.attach(BODY, 3, "c0ffee", 2.0)[1] == ()
    assert known.numbers == {}
    known.hear(decode_attachment(attachment))
    assert list(known.numbers[late.client]) == [late.sequence]
    calls.heard(HEAD, named)
    assert calls.attach(HEAD, 4, None, 2.0) == (b"", ())
