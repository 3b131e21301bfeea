"""Import and export documents as SCXML (W3C Recommendation of 1 September 2015)."""

from __future__ import annotations

from visualhfsm_old_documents.scxml._reader import is_scxml, parse_scxml
from visualhfsm_old_documents.scxml._writer import write_scxml

__all__ = ["is_scxml", "parse_scxml", "write_scxml"]
