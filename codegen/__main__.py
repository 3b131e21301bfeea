"""Run the command as `python -m codegen`."""

from __future__ import annotations

from .cli import main

main()
