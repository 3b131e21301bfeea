"""Who has a role, over hand-overs with lost messages, and by the costs that the others know."""

from __future__ import annotations

import pytest

from interfaces.nao import RoleClaim
from naoserver.serving._roles import Roles
from tests.support.teams import Contest


def test_it_takes_no_role_that_it_has_not_claimed_for_a_while_among_others():
    roles = Roles("a", alone=False)
    assert not roles.claim("striker", 1.0, "c", 0.0, [])
    roles.report(0.4)
    assert roles.reported() == []
    roles.report(0.6)
    assert [claim.role for claim in roles.reported()] == ["striker"]
    assert not roles.claim("striker", 1.0, "c", 0.65, [])
    assert roles.claim("striker", 1.0, "c", 0.75, [])


def test_of_two_that_have_it_the_one_with_the_higher_cost_gives_it_up():
    for cost, keeps in ((0.9, False), (1.1, True)):
        roles = Roles("b", alone=True)
        assert roles.claim("striker", 1.0, "c", 0.0, [])
        assert roles.claim("striker", 1.0, "c", 0.1, [("a", RoleClaim("striker", cost, True))]) is keeps


@pytest.mark.slow
def test_one_robot_has_a_role_in_a_thousand_hand_overs_with_a_tenth_of_the_messages_lost():
    seen = Contest(["a", "b", "c", "d"], seed=1, loss=0.1).hand_over(1000)
    assert seen.twice > 0, "nothing was lost: this shows nothing"
    assert seen.two <= 0.7, "two had it for longer than a message counts"
    assert seen.none <= 2.0


def test_the_same_seed_gives_the_same_hand_overs():
    first, second = (Contest(["a", "b", "c"], seed=5, loss=0.2).hand_over(30) for _ in range(2))
    assert first == second
