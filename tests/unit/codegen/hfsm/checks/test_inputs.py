"""Parameters, inputs and arguments: the code for them, and errors."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.diagnostics import Diagnostic, Diagnostics
from codegen.hfsm import compile_document
from hfsm_runtime import run
from tests.support.documents import compile_to, document, load, state, sub


def value(tag: str, name: str, type_name: str, default: str | None = None) -> str:
    written = "" if default is None else f"<default>{default}</default>"
    return f"<{tag}><name>{name}</name><type>{type_name}</type>{written}</{tag}>"


def errors_of(directory: Path, text: str) -> list[Diagnostic]:
    path = directory / "main.xml"
    path.write_text(text)
    diagnostics = Diagnostics()
    assert (compile_document(path, None, diagnostics) is None) == bool(diagnostics.errors)
    return diagnostics.errors


def with_parameters(*parameters: str, config: str = "", functions: str = "") -> str:
    head = f"<parameters>{''.join(parameters)}</parameters>"
    return document(sub(1, 0, state(1, "a", initial=True), functions=functions), head=head, config=config)


INTERFACE = "<iceinterface><nameinterface>head</nameinterface><nameproxy>Head</nameproxy><interface>PoseHead</interface></iceinterface>"


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ([value("parameter", "x y", "int", "1")], "cannot be a parameter"),
        ([value("parameter", "größe", "int", "1")], "cannot be a parameter"),
        ([value("parameter", "class", "int", "1")], "cannot be a parameter"),
        ([value("parameter", "clock", "int", "1")], "`self.clock` belongs to every component"),
        ([value("parameter", "_x", "int", "1")], "`self._x` belongs to every component"),
        ([value("parameter", "log_level", "str", '"info"')], "`--log-level` is an option of every component"),
        ([value("parameter", "record", "bool", "True")], "`--record` is an option of every component"),
        ([value("parameter", "x", "int", "1"), value("parameter", "x", "int", "2")], "a second parameter"),
        (
            [value("parameter", "x", "bool", "True"), value("parameter", "no_x", "int", "2")],
            "turns the parameter",
        ),
        ([value("parameter", "head", "int", "1")], "both a parameter and an interface"),
        ([value("parameter", "go", "int", "1")], "both a parameter and a function"),
        (
            [value("parameter", "x", "object", "1")],
            "its type must be one of int, float, bool, str, not `object`",
        ),
        ([value("parameter", "x", "", "1")], "its type must be one of int, float, bool, str"),
        ([value("parameter", "x", "int")], "it has no default: write one, such as `3`"),
        ([value("parameter", "x", "int", "1.5")], "`1.5` is not of type int, such as `3`"),
        ([value("parameter", "x", "int", "True")], "`True` is not of type int"),
        ([value("parameter", "x", "bool", "1")], "`1` is not of type bool"),
        ([value("parameter", "x", "float", "fast")], "`fast` is not a Python literal, such as `0.5`"),
        ([value("parameter", "x", "float", "1e999")], "too large"),
        ([value("parameter", "x", "str", "red")], '`red` is not a Python literal, such as `"red"`'),
    ],
)
def test_parameters_that_are_wrong(tmp_path: Path, parameters: list[str], message: str) -> None:
    text = with_parameters(*parameters, config=INTERFACE, functions="def go(self):\n    pass")
    (error,) = errors_of(tmp_path, text)
    assert error.code == "E526"
    assert message in error.message


def test_a_parameter_is_an_attribute_with_its_default(tmp_path: Path) -> None:
    made = load(compile_to(tmp_path, with_parameters(value("parameter", "speed", "float", "-1"))))
    assert made.speed == -1.0  # type: ignore[attr-defined]
    assert isinstance(made.speed, float)  # type: ignore[attr-defined]


def with_inputs(
    *inputs: str, arguments: str = "", variables: str = "", second: str = "", code: str = ""
) -> str:
    owner = state(1, "use", initial=True, child=2).replace("</state>", f"<child>3</child>{arguments}</state>")
    return document(
        sub(1, 0, owner),
        sub(2, 1, state(1, "a", code, initial=True), *inputs, variables=variables),
        sub(3, 1, state(1, "b", code, initial=True), second),
    )


def argument(name: str, expression: str = "1", child: int = 0) -> str:
    owner = f' child="{child}"' if child else ""
    return f'<argument name="{name}"{owner}>{expression}</argument>'


X = value("input", "x", "int", "1")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (with_inputs(value("input", "x y", "int", "1")), "cannot be an input"),
        (with_inputs(value("input", "self", "int", "1")), "cannot be an input"),
        (with_inputs(value("input", "event", "int", "1")), "cannot be an input"),
        (with_inputs(value("input", "an\u0303o", "int", "1")), "cannot be an input"),
        (with_inputs(X, X), "a second input has the name `x`"),
        (with_inputs(X, variables="x = 2"), "also set by the variables"),
        (with_inputs(value("input", "x", "long", "1")), "the type of the input `x` must be one of int,"),
        (
            with_inputs(value("input", "x", "int", '"1"')),
            'the default of the input `x`: `"1"` is not of type int',
        ),
        (with_inputs(value("input", "x", "int")), "`use` has to pass `x` to automaton 2"),
        (
            document(
                sub(1, 0, state(1, "use", initial=True, child=2)),
                sub(2, 1, state(1, "a", initial=True), value("input", "x", "int")),
            ),
            "`use` has to pass `x` to its automaton: it has no default",
        ),
        (with_inputs(X, arguments=argument("y")), "no automaton of state `use` has an input `y`"),
        (with_inputs(X, arguments=argument("y", child=2)), "automaton 2 has no input `y`"),
        (with_inputs(X, arguments=argument("x", child=9)), "state `use` does not own automaton 9"),
        (with_inputs(X, arguments=argument("x"), second=X), 'write `child="2"` or `child="3"`'),
        (with_inputs(X, arguments=argument("x") + argument("x", child=2)), "passes `x` twice"),
        (
            document(sub(1, 0, state(1, "a", initial=True), value("input", "x", "int"))),
            "the input `x` needs a default: no state owns this automaton",
        ),
    ],
)
def test_inputs_and_arguments_that_are_wrong(tmp_path: Path, text: str, message: str) -> None:
    (error,) = errors_of(tmp_path, text)
    assert error.code == "E527"
    assert message in error.message


def test_an_input_that_is_spelled_wrong_is_put_right(tmp_path: Path) -> None:
    speed = value("input", "speed", "int", "1")
    (error,) = errors_of(tmp_path, with_inputs(speed, arguments=argument("sped")))
    assert [note.message for note in error.notes] == ["did you mean `speed`?"]


@pytest.mark.parametrize(("parameter", "what"), [(("integer", "1"), "integer"), (("int", "fast"), "fast")])
def test_what_is_wrong_with_a_parameter_is_pointed_at(
    tmp_path: Path, parameter: tuple[str, str], what: str
) -> None:
    text = with_parameters(value("parameter", "x", *parameter))
    (error,) = errors_of(tmp_path, text)
    assert text.split("\n")[error.location.line - 1][error.location.column - 1 :].startswith(what)


@pytest.mark.parametrize("expression", ["", "a, b", "x = 1", "(yield)"])
def test_an_argument_is_an_expression(tmp_path: Path, expression: str) -> None:
    (error,) = errors_of(tmp_path, with_inputs(X, arguments=argument("x", expression)))
    assert error.code == "E520"


def test_an_argument_goes_to_the_automaton_that_is_named(tmp_path: Path) -> None:
    text = with_inputs(X, arguments=argument("x", "5", child=3), second=X, code="self.seen.append(x)")
    made = load(compile_to(tmp_path, text))
    seen: list[int] = []
    vars(made)["seen"] = seen
    _, first, second = run(made, 0).tree.actors
    assert (first.automaton.id, second.automaton.id) == (2, 3)
    assert seen == [1, 5]


def test_the_root_may_have_inputs_with_defaults(tmp_path: Path) -> None:
    text = document(sub(1, 0, state(1, "a", "self.seen = x", initial=True), value("input", "x", "int", "4")))
    made = load(compile_to(tmp_path, text))
    run(made, 0)
    assert made.seen == 4  # type: ignore[attr-defined]
