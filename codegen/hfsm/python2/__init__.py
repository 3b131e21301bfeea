"""Find the Python 2 in the code of old documents, and mend it where nothing else is wrong.

Every rule looks at the words of a piece of code and proposes edits; what no rule speaks of stays as it is,
byte for byte.
"""

from __future__ import annotations

from .documents import mend_document, report_python2
from .mending import Finding, find_python2, is_python, mend

__all__ = ["Finding", "find_python2", "is_python", "mend", "mend_document", "report_python2"]
