import pytest

from naoserver.errors import InvalidCommand
from naoserver.safety._guarded_device import Claims


def nothing():
    pass


def test_what_is_claimed_is_refused_to_others_by_name():
    claims = Claims()
    claims.claim("the walk", ("LKneePitch", "RKneePitch"), nothing)
    with pytest.raises(InvalidCommand, match="RKneePitch is moved by the walk now") as refusal:
        claims.check(("HeadYaw", "RKneePitch"))
    assert refusal.value.field == "RKneePitch"
    claims.check(("HeadYaw",))
    claims.check(("RKneePitch",), "the walk")


def test_a_claim_on_what_is_another_s_claims_nothing():
    claims = Claims()
    claims.claim("the walk", ("LKneePitch",), nothing)
    with pytest.raises(InvalidCommand, match="the walk"):
        claims.claim("dance", ("HeadYaw", "LKneePitch"), nothing)
    claims.check(("HeadYaw",))


def test_a_second_claim_takes_the_place_of_the_first():
    claims = Claims()
    claims.claim("dance", ("HeadYaw", "LKneePitch"), nothing)
    claims.claim("dance", ("HeadYaw",), nothing)
    claims.check(("LKneePitch",))


def test_what_is_released_is_anybody_s():
    claims = Claims()
    claims.claim("the walk", ("LKneePitch",), nothing)
    assert claims.release("the walk")
    assert not claims.release("the walk")
    claims.check(("LKneePitch",))


def test_to_stop_a_joint_stops_whom_it_belongs_to_and_leaves_it_what_it_needs_to_end():
    claims, stopped = Claims(), []

    def stop_dance():
        stopped.append("dance")
        claims.release("dance")

    claims.claim("the walk", ("LKneePitch",), lambda: stopped.append("the walk"))
    claims.claim("dance", ("LShoulderPitch",), stop_dance)
    assert claims.stop(("HeadYaw",)) == frozenset()
    assert stopped == []
    assert claims.stop(("HeadYaw", "LKneePitch", "LShoulderPitch")) == {"LKneePitch"}
    assert stopped == ["the walk", "dance"]


@pytest.mark.parametrize("error", [OSError("no line to the legs"), SystemExit(0)])
def test_one_that_cannot_be_stopped_keeps_nobody_else_from_being_stopped(caplog, error):
    claims, stopped = Claims(), []

    def fails():
        raise error

    claims.claim("the walk", ("RKneePitch", "LKneePitch"), fails)
    claims.claim("dance", ("HeadYaw",), lambda: stopped.append("dance"))
    assert claims.stop(("LKneePitch", "HeadYaw")) == {"LKneePitch", "HeadYaw"}
    assert stopped == ["dance"]
    assert caplog.messages == ["cannot stop what moves LKneePitch, RKneePitch"]
