"""What `tools/` writes from the code and from documents is as they are now."""

from __future__ import annotations

from collections.abc import Iterator
from importlib.util import find_spec

from tools.gallery import page as gallery
from tools.generators import protocol_types, shelf_page
from tools.lint.sources import ROOT


def mistakes() -> Iterator[str]:
    """Yield the files that are not current."""
    for path, text, module, needed in (
        (protocol_types.FILE, protocol_types.protocol_types, protocol_types.__name__, "visualhfsm"),
        (protocol_types.TRIALS, protocol_types.trials_types, protocol_types.__name__, "visualhfsm_trials"),
        (shelf_page.PAGE, shelf_page.shelf_page, shelf_page.__name__, "visualhfsm"),
        (gallery.PAGE, gallery.gallery, gallery.__name__, "visualhfsm_classes"),
    ):
        if find_spec(needed) and path.read_text("utf-8") != text():
            yield f"{path.relative_to(ROOT)}: write it again: python -m {module}"
