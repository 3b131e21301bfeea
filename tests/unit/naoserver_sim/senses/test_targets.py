"""What there is to be seen in a world."""

from collections import Counter

from naoserver_sim._senses._targets import fixed_targets
from naoserver_sim.world import load_world, parse_world
from tests.support.present import present

SOCCER = load_world("soccer")


def test_a_field_has_posts_lines_and_crossings():
    targets = [*fixed_targets(SOCCER)]
    found = Counter(target.kind for target in targets)
    assert (found["goalpost"], found["crossing"]) == (4, len(present(SOCCER.field).crossings))
    assert found["line"] > 500
    names = Counter(target.name for target in targets if target.kind == "crossing")
    assert names == {"L": 12, "T": 10, "X": 3, "mark": 2}


def test_signs_and_firm_boxes_have_their_names():
    text = """
[[signs]]
position = [2.0, 0.0]
landmark = 12

[[signs]]
position = [2.0, 1.0]

[[boxes]]
name = "Crate"
position = [1.0, 0.0]
size = [0.2, 0.2, 0.4]
color = [0.1, 0.2, 0.9]

[[boxes]]
name = "Loose"
position = [1.0, 1.0]
size = [0.2, 0.2, 0.4]
mass = 1.0
"""
    found = {
        (target.kind, target.name): target.middle for target in fixed_targets(parse_world(text, "signs"))
    }
    assert found == {
        ("tag", "12"): (2.0, 0.0, 0.5),
        ("face", ""): (2.0, 1.0, 0.5),
        ("box", "blue"): (1.0, 0.0, 0.2),
    }
