"""Names of transitions stand beside their handles, apart from everything else."""

from __future__ import annotations

from visualhfsm._drawing.arcs import Box, arc
from visualhfsm._drawing.labels import Label, Placed, Size, place_labels


def label(handle: complex, normal: complex, *sizes: tuple[float, float]) -> Label:
    return Label(handle, normal, tuple(Size(*each) for each in sizes))


def box_of(placed: Placed | None, label: Label) -> Box:
    assert placed is not None
    return Box.around(placed.middle, *label.sizes[placed.size])


def overlaps(one: Box, other: Box) -> bool:
    return (
        one.left < other.right
        and other.left < one.right
        and one.top < other.bottom
        and other.top < one.bottom
    )


def test_a_name_stands_on_the_best_side_of_its_handle() -> None:
    assert place_labels([label(100 + 100j, 1 + 0j, (50, 30))], []) == [Placed(139 + 100j, 0)]
    assert place_labels([label(100 + 100j, -1j, (50, 30))], []) == [Placed(100 + 71j, 0)]


def test_names_avoid_states_handles_and_other_names() -> None:
    states = [100 + 100j, 300 + 100j]
    labels = [label(complex(200, y), 1 + 0j, (80, 30)) for y in (80, 100, 120, 140)]
    boxes = [box_of(*each) for each in zip(place_labels(labels, states), labels, strict=True)]
    others = [Box.around(label.handle, 18, 18) for label in labels]
    others += [Box.around(state, 62, 62) for state in states]
    for index, box in enumerate(boxes):
        assert not any(overlaps(box, other) for other in [*others, *boxes[:index]])


def test_no_arc_crosses_a_name_that_has_another_place() -> None:
    states = [0j, 400 + 0j, 200 - 200j, 200 + 200j]
    down = arc(states[2], states[3], 200 + 0j, is_loop=False)
    beside = label(150 - 20j, 1 + 0j, (80, 16))
    (free,) = place_labels([beside], states)
    (placed,) = place_labels([beside], states, [down])
    assert box_of(free, beside).right > 200 > box_of(free, beside).left
    box = box_of(placed, beside)
    assert not any(
        box.left < point.real < box.right and box.top < point.imag < box.bottom for point in down.points(1.0)
    )


def test_a_long_name_is_whole_where_there_is_room_and_shorter_where_there_is_not() -> None:
    sizes = ((300.0, 16.0), (150.0, 16.0))
    states = [0j, 600 + 0j]
    (whole,) = place_labels([label(300 + 0j, -1j, *sizes)], states)
    assert whole is not None
    assert whole.size == 0
    crowd = [*states, *(complex(x, y) for x in (170, 430) for y in (-90, 0, 90)), 300 - 90j, 300 + 90j]
    (short,) = place_labels([label(300 + 0j, -1j, *sizes)], crowd)
    assert short is not None
    assert short.size == 1
    (outside,) = place_labels([label(700 + 0j, 1 + 0j, *sizes)], states)
    assert outside is not None
    assert outside.size == 1, "a picture grows only a little for a name"


def test_no_name_is_written_on_other_words() -> None:
    states = [0j, 400 + 0j]
    name = label(200 + 0j, -1j, (80, 30))
    (free,) = place_labels([name], states)
    title = box_of(free, name)
    (placed,) = place_labels([name], states, occupied=[title])
    assert not overlaps(box_of(placed, name), title)


def test_words_that_fill_the_plane_end_no_search() -> None:
    name = label(200 + 0j, -1j, (80, 30))
    everywhere = Box(-1e6, -1e6, 1e6, 1e6)
    (placed,) = place_labels([name], [0j, 400 + 0j], occupied=[everywhere])
    assert placed == Placed(200 - 29j, 0)


def test_a_name_beside_its_handle_comes_before_a_longer_way() -> None:
    handle = label(200 + 0j, -1j, (80, 30))
    wall = Box(100, -20, 300, -15)
    (placed,) = place_labels([handle], [0j, 400 + 0j], occupied=[wall])
    assert placed == Placed(254 + 0j, 0)


def test_no_name_stands_where_another_handle_is_nearer_which_would_seem_to_have_it() -> None:
    handle, other = label(0j, -1j, (40, 20)), label(-64j, 1j)
    below = Box(-200, -15, 200, 200)
    assert place_labels([handle], [], occupied=[below]) == [Placed(-44j, 0)]
    assert place_labels([handle, other], [], occupied=[below]) == [Placed(-24j, 0), None]


def test_without_a_free_place_a_name_covers_as_little_as_possible() -> None:
    crowd = [complex(x, y) for x in range(0, 400, 40) for y in range(0, 400, 40)]
    (placed,) = place_labels([label(200 + 200j, 1j, (60, 30))], crowd)
    assert placed is not None
    assert abs(placed.middle - (200 + 200j)) < 100


def test_labels_without_a_text_take_no_room() -> None:
    places = place_labels([label(100 + 100j, 1 + 0j), label(70 + 100j, 1j, (50, 30))], [])
    assert places == [None, Placed(70 + 129j, 0)]
