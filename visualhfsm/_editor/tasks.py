"""The task of an exercise, which lies in the folder of the document as docs/how-to/class.md describes.

Whoever wrote it is a stranger: nothing outside of the folder is read, and no text becomes HTML.
"""

from __future__ import annotations

from base64 import b64encode
from functools import lru_cache
from itertools import count
from mimetypes import guess_type
from pathlib import Path
from typing import Any, Final
from urllib.parse import unquote

from codegen.files import is_regular, read_regular
from visualhfsm._base.errors import MissingError
from visualhfsm._base.markdown import markdown
from visualhfsm.project._root import Root

_TASK, _EXERCISE, _MARKS, _TRIALS = "task.md", "exercise.toml", "marks.md", ".trials.toml"
_HAND_IN: Final = "hand-in"
"""The folder below the root from which a teacher collects, as in docs/how-to/classroom.md."""
_LONGEST: Final = 200_000  # bytes of a text
_LARGEST: Final = 1 << 20  # bytes of a picture
_MOST_PICTURES: Final = 20


@lru_cache(maxsize=256)
def has_task(path: Path | None) -> bool:
    """Whether the document of a file has a task; found once, since it is asked for with each change."""
    return path is not None and any(is_regular(path.parent / name) for name in (_TASK, _EXERCISE))


def collected(root: Root, path: Path) -> Path | None:
    """Return the file that a teacher collects of a document, named by its trials; None if nobody collects."""
    names = [each.name.removesuffix(_TRIALS) for each in sorted(path.parent.glob(f"*{_TRIALS}"))]
    name = path.stem if path.stem in names or not names else names[0]
    folder = root.directory / _HAND_IN
    return folder / f"{name}.xml" if folder.is_dir() else None


def read_task(root: Root, path: Path, language: str) -> dict[str, Any]:
    """Return the task of a document, in a language if it is there in it, the marks beside it, and since when
    a teacher can collect it, in s since 1970. Raises VisualHfsmError.
    """
    folder = path.parent.resolve()
    number = count(1)

    def inside(name: str) -> Path | None:
        file = folder / name
        is_inside = is_regular(file) and root.contains(file) and file.resolve().is_relative_to(folder)
        return file if is_inside else None

    def picture(source: str) -> str:
        file = inside(unquote(source))
        kind = guess_type(source, strict=False)[0] or ""
        if file is None or not kind.startswith("image/") or next(number) > _MOST_PICTURES:
            return ""
        content = read_regular(file, _LARGEST + 1)
        return f"data:{kind};base64,{b64encode(content).decode()}" if len(content) <= _LARGEST else ""

    def text(*names: str) -> str:
        found = next(filter(None, map(inside, names)), None)
        return "" if found is None else read_regular(found, _LONGEST).decode(errors="replace")

    with MissingError.in_place_of(OSError, "the task cannot be read: {reason}"):
        task = text(f"task.{language}.md", _TASK, "task.en.md")
        if inside(_EXERCISE):  # its author looks at it
            from visualhfsm.grading import points_table, read_exercise

            task += f"\n\n{points_table(read_exercise(folder), language)}"
        copy = collected(root, path)
        return {
            "text": markdown(task, picture),
            "marks": markdown(text(_MARKS), picture),
            "collected": "" if copy is None else root.name(copy),
            "handedIn": copy.stat().st_mtime if copy is not None and is_regular(copy) else None,
        }
