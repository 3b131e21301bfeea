"""SCXML (W3C Recommendation of 1 September 2015) as a format of documents, for the seam `codegen.formats`."""

from __future__ import annotations

from typing import Final

from visualhfsm_old_documents.scxml._reader import read, recognizes
from visualhfsm_old_documents.scxml._writer import write

__all__ = ["guide", "read", "recognizes", "suffix", "write"]

suffix: Final = ".scxml"
guide: Final = "plugins/old_documents/docs/scxml.md"
