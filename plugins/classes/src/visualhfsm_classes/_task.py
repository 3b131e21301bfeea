"""The task of an exercise, which lies in the folder of the document as docs/class.md describes."""

from __future__ import annotations

from base64 import b64encode
from contextlib import suppress
from functools import lru_cache
from mimetypes import guess_type
from pathlib import Path
from typing import Any, Final
from urllib.parse import unquote

from codegen.files import is_regular, read_regular
from visualhfsm.plugins import Root
from visualhfsm_classes._markdown import markdown

_TASK, _EXERCISE, _MARKS, _TRIALS = "task.md", "exercise.toml", "marks.md", ".trials.toml"
_HAND_IN: Final = "hand-in"  # from there, below the root, a teacher collects: docs/how-to/classroom.md
_LONGEST, _LARGEST = 200_000, 1 << 20  # bytes of a text, and of a picture
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
    """Return the task of a document, the marks beside it, and when what is collected was handed in.

    Strangers may have written them: nothing outside of the folder is read. Raises VisualHfsmError.
    """
    folder = path.parent.resolve()
    pictures = iter(range(_MOST_PICTURES))

    def read(name: str, limit: int) -> bytes:
        with suppress(OSError, RuntimeError, ValueError):  # it is missing, a loop of links, or no name
            file = (folder / name).resolve()
            return read_regular(file, limit) if file.is_relative_to(folder) and root.contains(file) else b""
        return b""

    def text(name: str) -> str:
        return read(name, _LONGEST).decode(errors="replace")

    def picture(source: str) -> str:
        kind = guess_type(source, strict=False)[0] or ""
        is_shown = kind.startswith("image/") and next(pictures, None) is not None
        content = read(unquote(source), _LARGEST + 1) if is_shown else b""
        return f"data:{kind};base64,{b64encode(content).decode()}" if 0 < len(content) <= _LARGEST else ""

    task = text(f"task.{language}.md") or text(_TASK) or text("task.en.md")
    if text(_EXERCISE):  # its author looks at it
        from visualhfsm_classes._exercise import read_exercise
        from visualhfsm_classes._handout import points_table

        task += f"\n\n{points_table(read_exercise(folder), language)}"
    copy = collected(root, path)
    return {
        "text": markdown(task, picture),
        "marks": markdown(text(_MARKS), picture),
        "collected": "" if copy is None else root.name(copy),
        "handedIn": copy.stat().st_mtime if copy is not None and is_regular(copy) else None,
    }
