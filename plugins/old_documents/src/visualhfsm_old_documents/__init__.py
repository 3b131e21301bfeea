"""Documents of other editors and older ones: SCXML, VisualStates, and the Spanish editor of 2013.

The package itself is a `codegen.hfsm.code.former.FormerCode`: what the code of such documents is.
"""

from typing import TYPE_CHECKING

from zenoh_ice.lazy import import_on_use

if TYPE_CHECKING:
    from ._languages import is_other_language as is_other_language
    from ._languages import language_of as language_of
    from ._languages import notes_about as notes_about
    from ._modernize import modernize as modernize
    from ._old_names import former_names as former_names

__getattr__, __dir__ = import_on_use(__name__)  # formats alone need none of them
