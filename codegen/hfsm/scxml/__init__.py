"""Exchange documents with other programs as SCXML (W3C Recommendation of 1 September 2015).

`writer` writes a document: `placement` finds the place of each part, `naming` its id, `said` knows what of it
SCXML says, `own_elements` keeps what it has no word for, `remarks` tells of that.

`reader` reads one: `qualified` knows whose word an element is, `chart` finds the states and automata,
`timers` and `code` see what they do, `routes` joins them by transitions, `entries` finds where they begin,
and `assembly` makes a native document of it, with the ids of `numbering`; `problems` are what it tells.

`vocabulary` and `data` serve both.
"""

from __future__ import annotations

from .reader import is_scxml, parse_scxml, read_scxml
from .writer import write_scxml

__all__ = ["is_scxml", "parse_scxml", "read_scxml", "write_scxml"]
