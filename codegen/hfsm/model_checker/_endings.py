"""Find code that may end the component, or its process: what is to come then never comes."""

from __future__ import annotations

from typing import Final

from ...diagnostics import Note
from ...messages import Message
from ..analysis import Analysis, names_with
from ..code.text import all_nodes, full_name

_ENDING: Final = frozenset(
    {"os._exit", "os.abort", "os.kill", "signal.raise_signal", "sys.exit", "KeyboardInterrupt", "SystemExit"}
)
_ENDING_BUILTINS: Final = frozenset({"exit", "quit"})
"""Names that code may well give to something else."""
_MESSAGE: Final = Message("this code may end the component")


def ending_code(analysis: Analysis) -> tuple[Note, ...]:
    """Return the places of code that may end the component, at most one for each piece of code."""
    own = analysis.defined.union(*(code.names for code in analysis.automata))
    ending = _ENDING | (_ENDING_BUILTINS - own)
    found = []
    for _, _, piece in analysis.by_text.values():
        if piece is None or piece.is_deep:
            continue  # it is slow, too, or the component cannot be generated
        modules = names_with(analysis.libraries, all_nodes(piece.tree))
        ends = next((each for each in all_nodes(piece.tree) if full_name(each, modules) in ending), None)
        if ends is not None:
            found.append(Note(_MESSAGE, piece.place(ends)))
    return tuple(found)
