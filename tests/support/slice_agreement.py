"""How often the Slice compiler and the reference compiler agree."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from hypothesis import HealthCheck, Phase, given, seed, settings

from .slice_compiler import checked, first_error
from .slice_grammar import slice_files
from .slice_reference import reference_verdicts


@dataclass
class Agreement:
    """Counts over files that both compilers have read."""

    files: int = 0
    accepted: int = 0
    """Files that the reference accepts."""
    accepted_by_both: int = 0
    refused_by_both: int = 0
    same_line: int = 0
    differences: list[str] = field(default_factory=list)

    @property
    def verdicts(self) -> float:
        """The share of files that both accept or both reject."""
        return (self.accepted_by_both + self.refused_by_both) / self.files if self.files else 1.0

    @property
    def acceptance(self) -> float:
        """The share of files that ours accepts, of those that the reference accepts."""
        return self.accepted_by_both / self.accepted if self.accepted else 1.0

    @property
    def wrongly_accepted(self) -> int:
        """The number of files that only ours accepts."""
        return self.files - self.accepted - self.refused_by_both

    @property
    def first_lines(self) -> float:
        """The share of files with the first error on the same line, of those that both reject."""
        return self.same_line / self.refused_by_both if self.refused_by_both else 1.0

    def report(self) -> str:
        """Return the first differences, one per line."""
        return "\n".join(self.differences[:20])


def compare(paths: Sequence[Path], directory: Path, include_directories: Sequence[Path] = ()) -> Agreement:
    """Read files with both compilers; a file on which the reference crashes does not count."""
    agreement = Agreement()
    included = [f"-I{path.resolve()}" for path in include_directories]
    for path, reference in zip(paths, reference_verdicts(paths, directory, included), strict=True):
        if reference is None:
            continue
        diagnostics = checked(path, include_directories)
        ours = first_error(diagnostics)
        agreement.files += 1
        agreement.accepted += reference.accepted
        agreement.accepted_by_both += ours.accepted and reference.accepted
        if not ours.accepted and not reference.accepted:
            agreement.refused_by_both += 1
            agreement.same_line += ours == reference
        if ours != reference:
            found = diagnostics.errors[0].message if diagnostics.has_errors else "accepted"
            agreement.differences.append(f"{path}: slice2py {reference}, ours {ours}: {found}")
    return agreement


def compare_generated(directory: Path, count: int, start: int = 0) -> Agreement:
    """Generate about `count` files from the grammar, always the same for a `start`, and compare."""
    texts: dict[str, None] = {}

    @seed(start)
    @settings(
        max_examples=count,
        database=None,
        phases=[Phase.generate],
        deadline=None,
        suppress_health_check=list(HealthCheck),
    )
    @given(slice_files())
    def collect(text: str) -> None:
        texts[text] = None

    collect()
    paths: list[Path] = []
    for number, text in enumerate(texts):
        paths.append(directory / f"file{number}.ice")
        paths[-1].write_text(text)
    return compare(paths, directory / "generated")
