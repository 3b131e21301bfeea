"""Exchange documents with other programs as SCXML (W3C Recommendation of 1 September 2015).

`writer` writes a document. `reader` reads one: it finds the states and joins them by transitions; `content`
translates their code. Where the file was written here, `changes` applies what another program has changed to
the native document in it. `vocabulary` has the words that all share.
"""

from __future__ import annotations

from .reader import is_scxml, parse_scxml, read_scxml
from .writer import write_scxml

__all__ = ["is_scxml", "parse_scxml", "read_scxml", "write_scxml"]
