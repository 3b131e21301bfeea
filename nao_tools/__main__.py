"""Start the command: `nao`, or `python -m nao_tools`."""

from __future__ import annotations

import os
from typing import NoReturn

from zenoh_ice.application import begin_loading


def main() -> NoReturn:
    """Run the command."""
    begin_loading(with_interfaces=False)  # it stops robots, whatever is wrong here
    from nao_tools._command import app
    from nao_tools._completion import join_words
    from zenoh_ice.application.cli import run

    if os.environ.get("_NAO_COMPLETE") == "complete_bash":
        join_words(os.environ)
    run(app)


if __name__ == "__main__":
    main()
