"""Names of transitions stand beside their handles, apart from everything else."""

from __future__ import annotations

from visualhfsm._drawing.arcs import Box
from visualhfsm._drawing.labels import Label, place_labels


def overlaps(one: Box, other: Box) -> bool:
    return (
        one.left < other.right
        and other.left < one.right
        and one.top < other.bottom
        and other.top < one.bottom
    )


def test_a_name_stands_on_the_best_side_of_its_handle() -> None:
    (place,) = place_labels([Label(100 + 100j, 1 + 0j, 50, 30)], [])
    assert place == 139 + 100j
    (place,) = place_labels([Label(100 + 100j, -1j, 50, 30)], [])
    assert place == 100 + 71j


def test_names_avoid_states_handles_and_other_names() -> None:
    states = [100 + 100j, 300 + 100j]
    labels = [Label(complex(200, y), 1 + 0j, 80, 30) for y in (80, 100, 120, 140)]
    places = place_labels(labels, states)
    boxes = [
        Box.around(place, label.width, label.height) for place, label in zip(places, labels, strict=True)
    ]
    others = [Box.around(label.handle, 18, 18) for label in labels]
    others += [Box.around(state, 70, 70) for state in states]
    for index, box in enumerate(boxes):
        assert not any(overlaps(box, other) for other in [*others, *boxes[:index]])


def test_without_a_free_place_a_name_covers_as_little_as_possible() -> None:
    crowd = [complex(x, y) for x in range(0, 400, 40) for y in range(0, 400, 40)]
    (place,) = place_labels([Label(200 + 200j, 1j, 60, 30)], crowd)
    assert abs(place - (200 + 200j)) < 100


def test_labels_without_a_text_take_no_room() -> None:
    empty = Label(100 + 100j, 1 + 0j, 0, 2)
    (_, place) = place_labels([empty, Label(70 + 100j, 1j, 50, 30)], [])
    assert place == 70 + 129j
