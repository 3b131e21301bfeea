"""Automata imported from other files: ids, their files, what else is imported, and errors."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from codegen.diagnostics import Diagnostics
from codegen.hfsm import compile_document, parse_document, resolve
from codegen.hfsm.document import Document
from codegen.hfsm.loading import check_document
from hfsm_runtime import VirtualRun, run
from tests.support.documents import compile_to, document, load, state, sub, transition


def imported(file: str, id: int = 2, father: int = 1, automaton: int = 0, inside: str = "") -> str:
    attribute = f' automaton="{automaton}"' if automaton else ""
    return f'<SubAutomata id="{id}" idFather="{father}"><import{attribute}>{file}</import>{inside}</SubAutomata>\n'


def root(*children: int) -> str:
    owners = (state(n, f"use {n}", initial=n == 1, child=child) for n, child in enumerate(children, 1))
    return sub(1, 0, *owners)


LIBRARY = document(
    sub(
        1,
        0,
        state(1, "outer", "self.note(1)", initial=True, child=2),
        functions="def note(self, x):\n    pass",
    ),
    sub(2, 1, state(1, "inner", initial=True, child=4), functions="def inner(self):\n    pass"),
    sub(4, 2, state(1, "innermost", "x = 1 / 0", initial=True)),
)


def resolved(
    directory: Path, text: str, *include: Path, most_automata: int = 10_000
) -> tuple[Document, list[str]]:
    path = directory / "main.xml"
    path.write_text(text)
    diagnostics = Diagnostics()
    parsed = parse_document(text, path, diagnostics)
    assert parsed is not None
    found = resolve(parsed, path, diagnostics, include, most_automata)
    return found, [f"{error.location.path.name}:{error.location.line}: {error.code}" for error in diagnostics]


def test_an_imported_automaton_keeps_the_id_of_its_place_and_those_below_get_new_ones(tmp_path: Path) -> None:
    (tmp_path / "lib.xml").write_text(LIBRARY)
    found, errors = resolved(tmp_path, document(root(2, 7), imported("lib.xml"), imported("lib.xml", id=7)))
    assert errors == []
    assert [(automaton.id, automaton.father) for automaton in found.automata] == [
        (1, 0), (2, 1), (2002, 2), (2004, 2002), (7, 1), (7002, 7), (7004, 7002)
    ]  # fmt: skip
    assert {automaton.path for automaton in found.automata[1:]} == {tmp_path / "lib.xml"}
    assert found.automata[0].path is None
    assert [automaton.states[0].children for automaton in found.automata] == [
        (2,), (2002,), (2004,), (), (7002,), (7004,), ()
    ]  # fmt: skip


def test_an_id_that_is_taken_gives_way_to_the_next(tmp_path: Path) -> None:
    (tmp_path / "lib.xml").write_text(LIBRARY)
    text = document(root(2, 2002), imported("lib.xml"), sub(2002, 1, state(1, "a", initial=True)))
    found, _ = resolved(tmp_path, text)
    assert sorted(automaton.id for automaton in found.automata) == [1, 2, 2002, 2003, 2004]


def test_ids_of_files_that_import_files_stay_in_range(tmp_path: Path) -> None:
    for number in range(1, 9):
        (tmp_path / f"lib{number}.xml").write_text(
            document(
                sub(1, 0, state(1, "a", initial=True, child=999)), imported(f"lib{number + 1}.xml", id=999)
            )
        )
    (tmp_path / "lib9.xml").write_text(LIBRARY)
    found, errors = resolved(tmp_path, document(root(2), imported("lib1.xml")))
    assert errors == []
    ids = [automaton.id for automaton in found.automata]
    assert len(set(ids)) == len(ids) == 12
    assert all(0 < number < 2**31 for number in ids)


def test_functions_of_a_file_stand_in_the_component_once_and_all_come_along(tmp_path: Path) -> None:
    (tmp_path / "lib.xml").write_text(LIBRARY)
    parts = (
        imported("lib.xml"),
        imported("lib.xml", id=3, automaton=4),
        imported("lib.xml", id=4, automaton=2),
    )
    source = compile_to(tmp_path, document(root(2, 3, 4), *parts)).read_text()
    assert source.count("def note(self, x):") == source.count("def inner(self):") == 1
    only_inner = compile_to(tmp_path, document(root(2), imported("lib.xml", automaton=4))).read_text()
    assert only_inner.count("def note(self, x):") == only_inner.count("def inner(self):") == 1


def test_what_is_imported_twice_is_written_once_and_has_its_own_variables_each_time(tmp_path: Path) -> None:
    code = "number += 1\nself.seen = {**getattr(self, 'seen', {}), (name, color): number}"
    color = '<input><name>color</name><type>str</type><default>""</default></input>'
    (tmp_path / "lib.xml").write_text(
        document(
            sub(1, 0, state(1, "count", code, initial=True), color, variables="number = 0\nname = 'ball'")
        )
    )
    owners = [
        state(1, "a", initial=True, child=2).replace(
            "</state>", '<argument name="color">"red"</argument></state>'
        ),
        state(2, "b", child=3).replace("</state>", '<argument name="color">"green"</argument></state>'),
    ]
    whole = sub(1, 0, *owners, transition(1, 1, 2, "200", type="time"))
    file = compile_to(tmp_path, document(whole, imported("lib.xml"), imported("lib.xml", id=3)))
    assert file.read_text().count("number += 1") == 1
    virtual = VirtualRun(component := load(file))
    virtual.advance(0.4)
    assert virtual.active_paths == ("b/count",)
    assert vars(component)["seen"] == {("ball", "red"): 2, ("ball", "green"): 3}


def test_an_error_names_the_imported_file_and_its_line(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "lib.xml").write_text(LIBRARY)
    (error,) = run(load(compile_to(tmp_path, document(root(2), imported("parts/lib.xml")))), 0).errors
    line = next(n for n, text in enumerate(LIBRARY.splitlines(), 1) if "1 / 0" in text)
    assert error.location.endswith(f"(parts/lib.xml:{line})")
    assert error.automaton == 2004


@pytest.mark.parametrize(
    "wrong",
    ["x = =", "if x:" + "".join(f"\n{' ' * deep}if x:" for deep in range(1, 97)) + "\n" + " " * 97 + "x = 2"],
)
def test_a_fault_is_reported_where_it_stands(tmp_path: Path, wrong: str) -> None:
    (tmp_path / "lib.xml").write_text(LIBRARY.replace("x = 1 / 0", wrong))
    path = tmp_path / "main.xml"
    path.write_text(document(root(2), imported("lib.xml")))
    diagnostics = Diagnostics()
    assert compile_document(path, None, diagnostics) is None
    (error,) = diagnostics.errors
    assert (error.code, error.location.path) == ("E520", tmp_path / "lib.xml")
    assert wrong.splitlines()[-1] in diagnostics.render()


def test_libraries_parameters_and_interfaces_come_along_once(tmp_path: Path) -> None:
    declared = "<parameters><parameter><name>speed</name><type>float</type><default>0.5</default></parameter></parameters>"
    config = "<iceinterface><nameinterface>head</nameinterface><nameproxy>Head</nameproxy><interface>PoseHead</interface></iceinterface>"
    parts: dict[str, Any] = {"libraries": ("math", "from math import pi"), "config": config, "head": declared}
    (tmp_path / "lib.xml").write_text(document(sub(1, 0, state(1, "a", "x = pi", initial=True)), **parts))
    made = load(compile_to(tmp_path, document(root(2), imported("lib.xml"), **parts)))
    assert made.speed == 0.5  # type: ignore[attr-defined]
    assert VirtualRun(made).errors == ()
    alone = compile_to(tmp_path, document(root(2), imported("lib.xml")), "alone").read_text()
    for line in (
        "\nfrom math import pi",
        "    speed = Parameter(0.5)",
        '    head = Proxy("Head", PoseHeadPrx)',
    ):
        assert alone.count(line) == 1


INTERFACE = "<iceinterface><nameinterface>head</nameinterface><nameproxy>{}</nameproxy><interface>PoseHead</interface></iceinterface>"


@pytest.mark.parametrize(
    ("own", "others"),
    [
        ({"config": INTERFACE.format("Head")}, {"config": INTERFACE.format("Head2")}),
        ({"libraries": ("numpy as np",)}, {"libraries": ("math as np",)}),
    ],
)
def test_contradictions_are_reported_with_both_places(
    tmp_path: Path, own: dict[str, Any], others: dict[str, Any]
) -> None:
    (tmp_path / "lib.xml").write_text(document(sub(1, 0, state(1, "a", initial=True)), **others))
    path = tmp_path / "main.xml"
    path.write_text(document(root(2), imported("lib.xml"), **own))
    diagnostics = Diagnostics()
    assert compile_document(path, None, diagnostics) is None
    (error,) = diagnostics.errors
    assert (error.code, error.location.path.name) == ("E553", "lib.xml")
    assert error.notes[0].location is not None
    assert error.notes[0].location.path == path


def test_functions_of_one_name_in_two_files_are_an_error(tmp_path: Path) -> None:
    (tmp_path / "lib.xml").write_text(LIBRARY)
    text = document(
        sub(1, 0, state(1, "a", initial=True, child=2), functions="def note(self): pass"), imported("lib.xml")
    )
    path = tmp_path / "main.xml"
    path.write_text(text)
    diagnostics = Diagnostics()
    assert compile_document(path, None, diagnostics) is None
    (error,) = diagnostics.errors
    assert (error.code, error.location.path.name) == ("E523", "lib.xml")
    assert error.notes[0].location is not None
    assert error.notes[0].location.path == path


@pytest.mark.parametrize(
    ("file", "code"),
    [
        ("absent.xml", "E550"),
        ("", "E551"),
        ("/etc/passwd", "E551"),
        ("../outside.xml", "E551"),
        ("link.xml", "E551"),
        ("inner", "E550"),
        ("main.xml", "E552"),
        ("inner/../main.xml", "E552"),
        ("ring.xml", "E552"),
        ("broken.xml", "E502"),
        ("cpp.xml", "E525"),
        ("two_roots.xml", "E554"),
    ],
)
def test_imports_that_are_refused(tmp_path: Path, file: str, code: str) -> None:
    home = tmp_path / "home"
    (home / "inner").mkdir(parents=True)
    (tmp_path / "outside.xml").write_text(LIBRARY)
    (home / "link.xml").symlink_to(tmp_path / "outside.xml")
    (home / "ring.xml").write_text(document(root(2), imported("main.xml")))
    (home / "broken.xml").write_text("<VisualHFSM>")
    (home / "cpp.xml").write_text(
        document(sub(1, 0, state(1, "a", "go();", initial=True)), head="<language>C++</language>")
    )
    (home / "two_roots.xml").write_text(document(root(0), sub(2, 0, state(1, "a", initial=True))))
    _, errors = resolved(home, document(root(2), imported(file)))
    assert [error.split()[-1] for error in errors] == [code]


@pytest.mark.parametrize(
    ("file", "code"),
    [
        ("absent.xml", "E550"),
        ("", "E551"),
        ("main.xml", "E552"),
        ("broken.xml", "E502"),
        ("two_roots.xml", "E554"),
        ("nested.xml", "E550"),
    ],
)
def test_an_import_that_fails_hides_no_other_check(tmp_path: Path, file: str, code: str) -> None:
    (tmp_path / "broken.xml").write_text("<VisualHFSM>")
    (tmp_path / "two_roots.xml").write_text(document(root(0), sub(2, 0, state(1, "a", initial=True))))
    (tmp_path / "nested.xml").write_text(document(imported("absent.xml", id=1, father=0)))
    go = transition(1, 1, 2, "go", type="event")
    head = (
        "<iceinterface><nameinterface>head</nameinterface><nameproxy>Head</nameproxy>"
        "<interface>PoseHead</interface></iceinterface>"
    )
    lines = "distance = 3\nnobody()\nself.nothing()\nself.head.setPose()\nself.head.nod()\ntime.sleep(3)"

    def check(code: str, *parts: str) -> list[tuple[str, bool]]:
        top = sub(1, 0, state(1, "top", code, initial=True, child=2), state(2, "end"), *parts)
        text = document(top, imported(file), libraries=("time",), config=head)
        (tmp_path / "main.xml").write_text(text)
        diagnostics = Diagnostics()
        assert check_document(tmp_path / "main.xml", diagnostics) is None
        return [
            (found.code, any("could not be imported" in note.message for note in found.notes))
            for found in diagnostics
            if found.location.path.name == "main.xml"
        ]

    alone = [("N608", False)] if file != "nested.xml" else []
    alone += [] if file in {"broken.xml", "nested.xml"} else [(code, False)]
    alone += [("N515", False)]  # of the state `end`, which is not final
    assert sorted(check("self.head.getPose()", transition(1, 1, 2, "1000", type="time"))) == sorted(alone)
    found = check(lines, go)
    assert sorted(found) == sorted(
        [
            *alone,
            *[("W520", True), ("W521", False), ("W523", False), ("W524", True), ("W526", True)],
            *[("W528", False), ("W529", False)],
        ]
    )
    broken = check("x = = 1", transition(1, 1, 9, "True"), transition(2, 1, 2, "x = = 1"))
    assert sorted(broken) == sorted([*alone, ("E514", False), ("E520", False), ("E520", False)])
    assert ("W514", False) in check("", transition(1, 2, 1, "go", type="event"))


def test_what_is_passed_to_an_import_that_fails_is_no_mistake(tmp_path: Path) -> None:
    argument = "<argument name='color'>3</argument>"
    result = "<result name='found'>seen</result>"
    top = state(1, "top", "self.log.info(seen)", initial=True, child=2).replace(
        "</state>", f"{argument}{result}</state>"
    )
    path = tmp_path / "main.xml"
    path.write_text(document(sub(1, 0, top, variables="seen = 0"), imported("absent.xml")))
    diagnostics = Diagnostics()
    check_document(path, diagnostics)
    assert [found.code for found in diagnostics] == ["E550", "N608"]


def test_which_states_are_never_entered_or_left_is_checked_without_an_import(tmp_path: Path) -> None:
    (tmp_path / "part.xml").write_text(document(sub(1, 0, state(1, "in"), state(2, "lost in the part"))))
    states = [state(1, "top", initial=True, child=2), state(2, "alone", child=3), state(3, "end")]
    text = document(
        sub(1, 0, *states, transition(1, 1, 3, "", type="finished")),
        imported("absent.xml"),
        imported("part.xml", id=3),
    )
    (tmp_path / "main.xml").write_text(text)
    diagnostics = Diagnostics()
    check_document(tmp_path / "main.xml", diagnostics)
    assert [(each.code, each.message) for each in diagnostics if each.code in {"N515", "W514"}] == [
        ("W514", "no transitions lead from `top` to `alone`"),
        ("N515", "no transition leads away from `end`: the automaton stays there"),
        ("W514", "no transitions lead from `in` to `lost in the part`"),
    ]


def test_one_line_says_what_is_not_checked_without_files(tmp_path: Path) -> None:
    (tmp_path / "nested.xml").write_text(document(root(2), imported("absent.xml")))
    (tmp_path / "main.xml").write_text(
        document(root(2, 3, 4), imported("nested.xml"), imported("broken.xml", id=3), imported(" ", id=4))
    )
    diagnostics = Diagnostics()
    check_document(tmp_path / "main.xml", diagnostics)
    (found,) = (each for each in diagnostics if each.code == "N608")
    assert (found.location.path.name, found.location.line > 1) == ("nested.xml", True)
    assert found.message.startswith("not checked without `absent.xml`, `broken.xml` and `?`: ")


def test_an_automaton_that_is_imported_has_nothing_of_its_own(tmp_path: Path) -> None:
    (tmp_path / "lib.xml").write_text(LIBRARY)
    for text in (imported("lib.xml", inside=state(1, "a")), imported("lib.xml", automaton=9)):
        _, errors = resolved(tmp_path, document(root(2), text))
        assert [error.split()[-1] for error in errors] == ["E554"]


def test_a_file_elsewhere_is_found_where_its_directory_is_allowed(tmp_path: Path) -> None:
    home, library = tmp_path / "home", tmp_path / "library"
    home.mkdir()
    library.mkdir()
    (library / "lib.xml").write_text(LIBRARY)
    for file in ("lib.xml", "../library/lib.xml"):
        found, errors = resolved(home, document(root(2), imported(file)), library)
        assert errors == []
        assert len(found.automata) == 4


def test_imports_do_not_multiply_without_end(tmp_path: Path) -> None:
    for number in range(7):
        (tmp_path / f"lib{number}.xml").write_text(
            document(root(2, 3), *(imported(f"lib{number + 1}.xml", id=child) for child in (2, 3)))
        )
    (tmp_path / "lib7.xml").write_text(LIBRARY)
    _, errors = resolved(tmp_path, document(root(2), imported("lib0.xml")), most_automata=100)
    assert "E552" in {error.split()[-1] for error in errors}


def test_many_files_in_a_row_are_refused(tmp_path: Path) -> None:
    for number in range(20):
        (tmp_path / f"lib{number}.xml").write_text(document(root(2), imported(f"lib{number + 1}.xml")))
    _, errors = resolved(tmp_path, document(root(2), imported("lib0.xml")))
    assert [error.split()[-1] for error in errors] == ["E552"]
