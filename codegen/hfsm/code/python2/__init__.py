"""Find the Python 2 in the code of old documents, and mend it where nothing else is wrong.

Every rule looks at the words of a piece of code and proposes edits; what no rule speaks of stays as it is,
byte for byte. `documents` does it for a whole document.
"""

from __future__ import annotations

from .mending import Finding, find_python2, is_python, mend, names_in

__all__ = ["Finding", "find_python2", "is_python", "mend", "names_in"]
