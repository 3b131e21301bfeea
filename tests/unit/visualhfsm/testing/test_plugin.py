"""The plugin in separate runs of pytest: timelines of failed tests, coverage, its reports and its gate."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy  # noqa: F401 - a process loads it once, and pytester lets go of what its runs load
import pytest

from tests.support.documents import document, state, sub, transition
from tests.support.places import ROOT
from tests.support.soak import cases
from visualhfsm.testing import MakeBehavior

pytest_plugins = "pytester"

LAMP = document(
    sub(
        1,
        0,
        state(1, "off", "n += 1", initial=True),
        state(2, "on"),
        state(3, "broken"),
        transition(1, 1, 2, "n > 3", name="switch"),
        transition(2, 2, 1, "500", type="time", name="timer"),
        transition(3, 2, 3, "n > 1000", name="wear"),
        variables="n = 0",
    )
)
TESTS = """
    def test_lit(behavior):
        b = behavior("lamp.xml")
        b.advance(0.5)
        assert b.active == "on"

    def test_worn(behavior):
        b = behavior("lamp.xml")
        b.set("lamp", n=5000)
        b.advance(1.0)
        assert b.active == "broken"
"""
COVERAGE = "--hfsm-cov=lamp.xml"
BOTH = [
    "lamp.xml * 3/3 * 2/3 * 4/4 * 90 %",
    "-*",
    "total * 3/3 * 2/3 * 4/4 * 90 %",
    "",
    "missing:",
    "  lamp.xml:7: transition timer of lamp (on -> off): never fired",
]
"""What both tests of a lamp cover."""


def results_in(project: pytest.Pytester) -> list[dict[str, Any]]:
    """Return the results that `--hfsm-results=results` wrote."""
    *lines, end = (project.path / "results").read_text(encoding="utf-8").splitlines()
    assert not end  # the tests have come to theirs
    return [json.loads(line) for line in lines]


@pytest.fixture
def lamp(pytester: pytest.Pytester) -> pytest.Pytester:
    """A project with a document and tests."""
    (pytester.path / "lamp.xml").write_text(LAMP, encoding="utf-8")
    pytester.makeini("[pytest]\naddopts = -p no:anyio -p no:hypothesispytest")  # they take half of the start
    pytester.makepyfile(TESTS)
    return pytester


def test_a_document_leaves_no_module_behind(lamp: pytest.Pytester) -> None:
    lamp.makepyfile(
        """
        import sys

        import pytest

        from visualhfsm.testing import UnknownName, check_properties

        def test_a_behavior(behavior):
            b = behavior("lamp.xml")
            b.reload("lamp.xml")
            with pytest.raises(UnknownName):
                behavior("lamp.xml", parameters={"none": 1})
            assert [name for name in sys.modules if name.startswith("lamp_")]

        def test_properties():
            check_properties("lamp.xml", lambda b: True, abstract=False, examples=2)

        def test_nothing_is_left():
            assert not [name for name in sys.modules if name.startswith("lamp_")]
        """
    )
    lamp.runpytest().assert_outcomes(passed=3)


@pytest.mark.slow
def test_a_behavior_is_let_go_of_with_its_test(lamp: pytest.Pytester) -> None:
    lamp.makepyfile(
        """
        import gc
        import weakref

        made = []

        def test_a_behavior(behavior):
            made.append(weakref.ref(behavior("lamp.xml")))

        def test_nothing_is_kept(request):
            assert request.session.items[0].name == "test_a_behavior", "pytest keeps the test itself"
            gc.collect()
            assert made[0]() is None
        """
    )
    lamp.runpytest().assert_outcomes(passed=2)


def test_a_failed_test_shows_the_timeline_of_its_behavior_once(lamp: pytest.Pytester) -> None:
    lamp.makepyfile(
        """
        class Silent(Exception):
            def __str__(self):
                raise RuntimeError("no text")

        def test_wrong(behavior):
            b = behavior("lamp.xml")
            b.advance(0.5)
            assert b.active == "off"

        def test_whose_error_has_it(behavior):
            behavior("lamp.xml").run_until("broken", limit=1)

        def test_whose_exception_has_no_text(behavior):
            behavior("lamp.xml")
            raise Silent

        def test_without_a_behavior():
            assert False

        def test_right(behavior):
            behavior("lamp.xml").advance(0.5)
        """
    )
    result = lamp.runpytest()
    result.assert_outcomes(passed=1, failed=4)
    result.stdout.fnmatch_lines(
        [
            "*assert 'on' == 'off'*",
            "*- behavior -*",
            "timeline of lamp, 0.500 s, in on",
            "     0.000 s  lamp: enters off",
            "     0.400 s  lamp: off -> on  by switch when n > 3",
            "*_ test_whose_exception_has_no_text _*",
            "*- behavior -*",
            "timeline of lamp, *",
        ]
    )
    assert result.stdout.str().count("timeline of lamp") == 3
    assert result.stdout.str().count("- behavior -") == 2


def test_the_table_reports_what_is_missing_and_where(lamp: pytest.Pytester) -> None:
    result = lamp.runpytest(COVERAGE, "-k", "test_lit")
    result.stdout.fnmatch_lines(
        [
            "document * states *transitions *guards *covered",
            "lamp.xml * 2/3 * 1/3 * 3/4 * 60 %",
            "missing:",
            "  lamp.xml:5: state lamp/broken was never entered",
            "  lamp.xml:7: transition timer of lamp (on -> off): never fired",
            "  lamp.xml:8: transition wear of lamp (on -> broken): never fired, its guard was never true",
        ]
    )
    result.stdout.no_fnmatch_line("document*lines*")


def test_a_test_that_fails_counts_too(lamp: pytest.Pytester) -> None:
    lamp.makepyfile('def test_it(behavior): b = behavior("lamp.xml"); b.advance(0.5); assert 0')
    lamp.runpytest(COVERAGE).stdout.fnmatch_lines(["lamp.xml * 2/3 *"])


def test_what_no_test_runs_counts_as_missing(lamp: pytest.Pytester) -> None:
    (lamp.path / "more").mkdir()
    (lamp.path / "more" / "other.xml").write_text(LAMP, encoding="utf-8")
    result = lamp.runpytest("--hfsm-cov=more", "--hfsm-cov=lamp.xml")
    result.stdout.fnmatch_lines(
        ["more/other.xml * 0/3 * 0/3 * 0/4 * 0 %", "lamp.xml * 3/3 *", "total * 3/6 *"]
    )


@pytest.mark.soak("test_lines_that_never_ran_are_reported_if_one_asks")
def test_the_workers_of_xdist_count_together(lamp: pytest.Pytester) -> None:
    result = lamp.runpytest(COVERAGE, "-n2", "--dist=load")
    result.assert_outcomes(passed=2)
    result.stdout.fnmatch_lines(BOTH, consecutive=True)


@pytest.mark.slow
@pytest.mark.parametrize(
    "more",
    cases(
        [pytest.param(["-n2", "--dist=load"], id="workers of xdist")], [pytest.param([], id="one process")]
    ),
)
def test_lines_that_never_ran_are_reported_if_one_asks(
    lamp: pytest.Pytester, more: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("COVERAGE_PROCESS_CONFIG", raising=False)  # else these processes are measured already
    code = "n += 1\nif n == 9000:\n    n = 0\n    n = 1"
    (lamp.path / "lamp.xml").write_text(LAMP.replace("n += 1", code), encoding="utf-8")
    result = lamp.runpytest_subprocess(COVERAGE, "--hfsm-cov-lines", *more)
    result.assert_outcomes(passed=2)
    result.stdout.fnmatch_lines(
        [
            "document * states *transitions *guards *lines *covered",
            "lamp.xml * 3/3 * 2/3 * 4/4 * 5/7 *",
            "missing:",
            "  lamp.xml:5: code of off: never ran 5, 6",
        ]
    )


OWN_CONTEXT = """
    import contextvars

    import pytest

    @pytest.hookimpl(tryfirst=True)
    def pytest_pyfunc_call(pyfuncitem):
        arguments = {each: pyfuncitem.funcargs[each] for each in pyfuncitem._fixtureinfo.argnames}
        contextvars.copy_context().run(pyfuncitem.obj, **arguments)
        return True
"""
"""Runs each test in a context of its own, as pytest-asyncio and anyio do with a coroutine."""


@pytest.mark.slow
def test_a_test_may_run_in_a_context_of_its_own(
    lamp: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("COVERAGE_PROCESS_CONFIG", raising=False)  # else the process is measured already
    lamp.makeconftest(OWN_CONTEXT)
    lamp.runpytest_subprocess("--hfsm-results=results").assert_outcomes(passed=2)
    assert all(each["code"] for each in results_in(lamp))


@pytest.mark.slow
def test_each_result_is_written_once_also_by_workers(lamp: pytest.Pytester) -> None:
    (lamp.path / "test_unreadable.py").write_text("import nowhere", encoding="utf-8")
    (lamp.path / "test_end.py").write_text("def test_end(): __import__('os')._exit(1)", encoding="utf-8")
    lamp.runpytest("-n2", "--hfsm-results=results", "--continue-on-collection-errors")
    assert sorted(
        (each["name"].rpartition(":")[2], each["outcome"], bool(each["hits"])) for each in results_in(lamp)
    ) == [
        ("test_end", "failed", False),
        ("test_lit", "passed", True),
        ("test_unreadable.py", "failed", False),
        ("test_worn", "passed", True),
    ]


@pytest.mark.parametrize(("least", "code"), [(90, 0), (90.1, 1)])
def test_the_hits_of_all_tests_count_together_and_too_little_coverage_fails_the_run(
    lamp: pytest.Pytester, least: float, code: int
) -> None:
    result = lamp.runpytest(COVERAGE, f"--hfsm-cov-fail-under={least}")
    result.assert_outcomes(passed=2)
    result.stdout.fnmatch_lines(BOTH, consecutive=True)
    assert result.ret == code
    reported = "FAIL: 90.0 % of the automata is covered, less than the required 90.1 %" in result.stdout.str()
    assert reported == bool(code)


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        (["--hfsm-cov=nowhere.xml"], "*--hfsm-cov: there is no *nowhere.xml*"),
        (["--hfsm-cov=bad.xml"], "*bad.xml*cannot be read*"),
    ],
)
def test_wrong_options_are_reported(lamp: pytest.Pytester, options: list[str], problem: str) -> None:
    (lamp.path / "bad.xml").write_text("<VisualHFSM>", encoding="utf-8")
    result = lamp.runpytest(*options)
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines([problem])


def test_a_document_beside_the_test_comes_first(lamp: pytest.Pytester) -> None:
    folder = lamp.path / "folder"
    folder.mkdir()
    (folder / "lamp.xml").write_text(LAMP.replace(">off<", ">dark<"), encoding="utf-8")
    (folder / "test_inner.py").write_text(
        'def test_it(behavior): assert behavior("lamp.xml").active == "dark"', encoding="utf-8"
    )
    lamp.runpytest("folder").assert_outcomes(passed=1)


def test_a_component_may_be_given_instead_of_its_document(behavior: MakeBehavior) -> None:
    from behaviors.dance import Dance

    b = behavior(Dance, robot="fake")
    assert b.active == "up"
    assert b.document == Path("behaviors/dance.xml").resolve()


def test_automata_of_one_name_are_distinguished_in_what_is_missing(pytester: pytest.Pytester) -> None:
    part = document(sub(1, 0, state(1, "x", initial=True), state(2, "y"), transition(1, 1, 2, "False")))
    (pytester.path / "part.xml").write_text(part, encoding="utf-8")
    imported = '<SubAutomata id="{}" idFather="1"><import>part.xml</import></SubAutomata>'
    both = state(1, "off", initial=True).replace("</state>", "<child>2</child><child>3</child></state>")
    text = document(sub(1, 0, both), imported.format(2), imported.format(3))
    (pytester.path / "lamp.xml").write_text(text, encoding="utf-8")
    pytester.makepyfile("def test_it(behavior):\n    behavior('lamp.xml').advance(1.0)")
    result = pytester.runpytest(COVERAGE)
    result.assert_outcomes(passed=1)
    result.stdout.fnmatch_lines(
        ["  part.xml:*: state off (2)/y was never entered", "  part.xml:*: state off (3)/y was never entered"]
    )


def test_other_files_beside_the_documents_do_not_count(lamp: pytest.Pytester) -> None:
    (lamp.path / "package.xml").write_text("<package/>", encoding="utf-8")
    result = lamp.runpytest("--hfsm-cov=.", "-k", "test_lit")
    result.assert_outcomes(passed=1, deselected=1)
    result.stdout.fnmatch_lines(["lamp.xml *"])


def test_what_is_wrong_with_a_test_is_reported_without_our_own_code(lamp: pytest.Pytester) -> None:
    wrong = (
        'b.run_until("brek", limit=1)', 'b.state("lmp")', 'behavior("lamp.xml", parameters={"x": 1})',
    )  # fmt: skip
    lamp.makepyfile(
        "\n\n".join(
            f"def test_{number}(behavior):\n    b = behavior('lamp.xml')\n    {line}"
            for number, line in enumerate(wrong)
        )
    )
    result = lamp.runpytest()
    result.assert_outcomes(failed=3)
    result.stdout.fnmatch_lines([f">*{line.partition('(')[0]}*" for line in wrong])
    result.stdout.no_fnmatch_line("*visualhfsm/simulation/_behavior.py*")
    result.stdout.no_fnmatch_line("*hfsm_runtime/virtual/execution.py*")
    result.stdout.no_fnmatch_line("*visualhfsm/testing/_plugin.py*")


@pytest.mark.slow
def test_nothing_is_loaded_for_tests_without_behaviors(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(
        """
        import sys

        def test_it():
            assert not {"zenoh", "numpy", "codegen", "hypothesis.strategies", "mujoco"} & sys.modules.keys()
        """
    )
    pytester.runpytest_subprocess("-p", "no:hypothesispytest").assert_outcomes(passed=1)


def test_the_plugin_comes_with_the_package() -> None:
    import tomllib

    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    assert project["entry-points"]["pytest11"] == {
        "hfsm": "visualhfsm.testing._plugin",
        "naoserver": "naoserver.conformance._entry",
    }
