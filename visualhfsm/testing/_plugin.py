"""The pytest plugin: the fixture `behavior`, the timeline of a failed test, and the coverage of automata.

Every pytest run loads it, so its dependencies are imported only when they are needed.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Protocol

import pytest

from zenoh_ice.application import hidden_interfaces
from zenoh_ice.data.text import text_of

if TYPE_CHECKING:
    from hfsm_runtime import Component
    from visualhfsm.simulation import Behavior, CameraKind, RobotKind, Team
    from zenoh_ice import Object


def __tracebackhide__(caught: pytest.ExceptionInfo[BaseException]) -> bool:  # noqa: N807 - the name is pytest's
    """Return whether pytest need not show our code, because the error says it all."""
    if "hfsm_runtime" not in sys.modules:
        return False  # not an error of it
    from hfsm_runtime.virtual.errors import says_it_all

    return says_it_all(caught)


_BEHAVIORS: Final = pytest.StashKey["list[Behavior]"]()
_COVERAGE: Final = "hfsm_coverage"
_RESULTS: Final = "hfsm_results"
_LINES: Final = "hfsm_lines"


class MakeBehavior(Protocol):
    """The fixture `behavior`."""

    def __call__(
        self,
        document: str | Path | type[Component],
        *,
        robot: RobotKind | None = None,
        parameters: Mapping[str, object] | None = None,
        stubs: Mapping[str, Object | Mapping[str, object]] | None = None,
        on_error: str | None = None,
        camera: CameraKind = "auto",
        include: Sequence[str | Path] = (),
        **settings: Any,  # noqa: ANN401
    ) -> Behavior:
        """Run a document, or a component, in virtual time; it is closed after the test.

        A relative path is looked up next to the test, then below the project root. `robot` is `fake`,
        `sim` or None; `stubs` answer interfaces by hand; `include` are directories with packages of
        interfaces that are neither beside the document nor in the project's folder `interfaces`; `settings`
        are those of the robot, such as `posture`, or `body`: the name of one that is known, such as `H21`, or
        the TOML file of one's own, a relative path as that of a document.
        """


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options."""
    group = parser.getgroup("hfsm", "automata")
    group.addoption(
        "--hfsm-cov",
        action="append",
        default=[],
        metavar="DOCUMENT-OR-DIR",
        help="measure which states, transitions and guards of these documents the tests cover; repeatable",
    )
    group.addoption(
        "--hfsm-cov-lines",
        action="store_true",
        help="with --hfsm-cov, measure which lines of their code run, too; tests take longer",
    )
    group.addoption("--hfsm-cov-fail-under", type=float, metavar="PERCENT", help="fail when less is covered")
    group.addoption(
        "--hfsm-results", metavar="FILE", help="write each result as a line of JSON, for the editor"
    )


def pytest_configure(config: pytest.Config) -> None:
    """Measure what tests pass if an option requests it."""
    documents, file = config.getoption("--hfsm-cov"), config.getoption("--hfsm-results")
    lines = None
    if file or (documents and config.getoption("--hfsm-cov-lines")):
        from ._lines import Lines

        lines = Lines()
        config.pluginmanager.register(lines, _LINES)
    if documents:
        from ._coverage import CoverageSession

        wanted = lines if config.getoption("--hfsm-cov-lines") else None
        config.pluginmanager.register(CoverageSession(config, wanted), _COVERAGE)
    if file:
        from ._results import Results

        assert lines is not None
        config.pluginmanager.register(Results(config, Path(file), lines), _RESULTS)


@pytest.fixture
def behavior(request: pytest.FixtureRequest) -> Iterator[MakeBehavior]:
    """Make behaviors that run in virtual time; each is closed after the test."""
    if hidden := hidden_interfaces():
        pytest.fail(hidden, pytrace=False)
    from visualhfsm.simulation import simulate

    made: list[Behavior] = []
    request.node.stash[_BEHAVIORS] = made
    coverage = request.config.pluginmanager.get_plugin(_COVERAGE)
    results = request.config.pluginmanager.get_plugin(_RESULTS)
    lines = request.config.pluginmanager.get_plugin(_LINES)
    places = [request.path.parent, request.config.rootpath]

    def make(
        document: str | Path | type[Component],
        *,
        include: Sequence[str | Path] = (),
        **options: Any,  # noqa: ANN401 - those of `simulate`
    ) -> Behavior:
        if not isinstance(document, type):
            document = _find_file("document", Path(document), places)
        if Path(body := str(options.get("body", ""))).suffix:  # a file, and not the name of a body
            options["body"] = _find_file("robot", Path(body), places)
        if lines is not None:
            lines.begin(document if isinstance(document, type) else None)
        behavior = simulate(document, include=_find_directories(include, places), **options)
        made.append(behavior)
        if coverage is not None and behavior.document is not None:
            coverage.hits.watch(lambda: behavior.document, behavior.tree)
        if results is not None:
            results.watch(behavior)
        if lines is not None:
            lines.watch(behavior)
        return behavior

    yield make
    # pytest keeps each test until the end of its run, and a behavior keeps all that it saw.
    del request.node.stash[_BEHAVIORS]
    for behavior in made:
        behavior.close()


@pytest.fixture
def team(request: pytest.FixtureRequest) -> Iterator[Callable[..., Team]]:
    """Make teams of behaviors that run in virtual time in one world; each is closed after the test.

    The documents are looked up as that of `behavior`; options are those of `simulate_team`.
    """
    from visualhfsm.simulation import simulate_team

    places = [request.path.parent, request.config.rootpath]
    with ExitStack() as made:

        def make(*documents: str | Path | type[Component], **options: Any) -> Team:  # noqa: ANN401
            found = [
                each if isinstance(each, type) else _find_file("document", Path(each), places)
                for each in documents
            ]
            return made.enter_context(simulate_team(found, **options))

        yield make


class RunTrials:
    """The fixture `trials`; relative paths are looked up in the `places`, in order."""

    def __init__(self, places: Sequence[Path]) -> None:
        self._places = places

    def __call__(
        self,
        path: str | Path,
        *,
        success: str | None = None,
        workers: int | None = None,
        **changes: Any,  # noqa: ANN401
    ) -> Any:  # noqa: ANN401 - the `Summary` of a plug-in
        """Run the trials of a plan, or of a document with a plan beside it, and return what they say.

        A relative path is looked up next to the test, then below the project root. `success` is the state
        that a trial must reach, `changes` are other keys of the plan, such as `runs` and `seed`. What they
        say is a `visualhfsm_trials.Summary`.
        """
        from visualhfsm.trials import plan_of
        from zenoh_ice.plugins import optional

        file = _find_file("plan or document", Path(path), self._places)
        plug_in = optional("visualhfsm_trials", "visualhfsm[trials]")
        return plug_in.run_trials(plan_of(file, success, **changes), workers=workers)


@pytest.fixture
def trials(request: pytest.FixtureRequest) -> RunTrials:
    """Run a behavior many times."""
    return RunTrials([request.path.parent, request.config.rootpath])


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(
    collector: pytest.Collector,
) -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    """Name the module that hides the package `interfaces` where a file of tests cannot import it."""
    report = yield
    if report.failed and "interfaces" in str(report.longrepr) and (hidden := hidden_interfaces()):
        report.longrepr = f"{collector.nodeid}: {hidden}"
    return report


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Add the timelines of its behaviors to the report of a failed test."""
    report = yield
    if report.when == "call" and report.failed and call.excinfo is not None:
        message = text_of(call.excinfo.value)
        for behavior in item.stash.get(_BEHAVIORS, []):
            if behavior.timeline not in message:
                report.sections.append(("behavior", behavior.timeline))
    return report


def _find_file(what: str, path: Path, directories: Sequence[Path]) -> Path:
    """Return the path of a file; a relative one is looked up in the directories, in order."""
    return _find(what, [directory / path for directory in directories], path, Path.is_file)


def _find_directories(wanted: Sequence[str | Path], directories: Sequence[Path]) -> list[Path]:
    """Return the paths of directories; a relative one is looked up in the other directories."""
    several = [wanted] if isinstance(wanted, str) else wanted
    return [
        _find("directory", [directory / each for directory in directories], each, Path.is_dir)
        for each in several
    ]


def _find(what: str, tried: Sequence[Path], name: str | Path, is_there: Callable[[Path], bool]) -> Path:
    for candidate in tried:
        if is_there(candidate):
            return candidate
    raise FileNotFoundError(f"there is no {what} {name}; looked for {', '.join(map(str, tried))}")
