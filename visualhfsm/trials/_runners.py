"""Where trials run, and behind which walls: what plug-ins add.

`visualhfsm_trials` runs them in a `Pool` of workers at an address; `visualhfsm_classes` contains the code of
strangers in a `Sandbox`.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Future
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, Self, TypeVar

from zenoh_ice.plugins import NotInstalledError, optional

from ._archive import Archive
from ._errors import TrialsError

if TYPE_CHECKING:
    from codegen.hfsm.document import Document
    from visualhfsm.simulation import Behavior

R = TypeVar("R")
R_co = TypeVar("R_co", covariant=True)


class Work(Protocol[R_co]):
    """What a pool runs, such as a trial; it can be pickled."""

    @property
    def number(self) -> int:
        """What it is called by in errors."""

    @property
    def patience(self) -> float:
        """How long it may take by the wall, in s."""

    @property
    def archive(self) -> Archive:
        """The files that it needs, which others may need, too."""

    def with_archive(self, archive: Archive) -> Self:
        """Return the same with another archive, such as one without its content."""

    def run(self) -> R_co:
        """Run it in a process of the thread that calls this. Raises VisualHfsmError."""


class Pool(Protocol[R]):
    """Where trials, or other work, run. A future that is canceled frees its place there."""

    @property
    def workers(self) -> int:
        """How many trials run at a time."""

    @property
    def lost(self) -> tuple[type[BaseException], ...]:
        """The errors of tasks that are to be submitted again."""

    def submit(self, task: Work[R]) -> Future[R]:
        """Begin to run a task, as soon as a worker has time."""

    def check(self) -> None:
        """Raise TrialsError when nothing will run any more."""


class Sandbox(Protocol):
    """Where the code of strangers' documents runs: out of reach of files, network, robot and who judges."""

    def read(self, document: str | Path) -> Document:
        """Return what a document says. Raises DocumentInvalid if it cannot run."""

    def simulate(self, document: str | Path, **options: Any) -> Behavior:  # noqa: ANN401 - those of Behavior
        """Return a behavior in virtual time, as `visualhfsm.simulation.simulate` does."""


def find_sandbox(
    *, files: Sequence[Path], unsafe: bool, seconds: float = 0.0
) -> AbstractContextManager[Sandbox]:
    """Return what contains code of documents, which may import `files`; without walls if it is `unsafe`.

    What the code may use grows with the `seconds` for which it runs by the robot's clock.
    Raises TrialsError without the plug-in; making and entering it raise VisualHfsmError where this computer
    can contain nothing.
    """
    classes = _plug_in("visualhfsm_classes", "visualhfsm[classes]")
    sandbox: AbstractContextManager[Sandbox]
    sandbox = classes.Containment(files=files, unsafe=unsafe, seconds=seconds)
    return sandbox


def find_runner(address: str) -> AbstractContextManager[Pool[Any]]:
    """Return the pool of workers at an address. Raises TrialsError."""
    trials = _plug_in("visualhfsm_trials", "visualhfsm[cluster]")
    pool: AbstractContextManager[Pool[Any]] = trials.Cluster(address)
    return pool


def _plug_in(module: str, install: str) -> Any:  # noqa: ANN401 - of what the core may not import
    with TrialsError.in_place_of(NotInstalledError):
        return optional(module, install)
