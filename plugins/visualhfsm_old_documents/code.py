"""What the code of former documents is, and which names it relies on: what `codegen.code` asks for."""

from __future__ import annotations

from ._languages import is_other_language, language_of, notes_about
from ._modernize import modernize
from ._old_names import former_names

__all__ = ["former_names", "is_other_language", "language_of", "modernize", "notes_about"]
