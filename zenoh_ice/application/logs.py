"""Logging of all commands: as text or JSON, to stderr or to files that rotate."""

from __future__ import annotations

import logging
import os
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Final

from zenoh_ice.data.exceptions import ConfigurationException
from zenoh_ice.data.status import program_name
from zenoh_ice.settings import Settings

if TYPE_CHECKING:
    from logging.handlers import RotatingFileHandler

_TEXT: Final = "%(asctime)s.%(msecs)03d %(levelname)-8s %(name)s: %(message)s"
_DATE: Final = "%Y-%m-%d %H:%M:%S"
_MOST_BYTES: Final = 10_000_000  # of a file; then it is renamed to FILE.1, that to FILE.2, and so on
_OLD_FILES: Final = 5


class _JsonFormatter(logging.Formatter):
    """One JSON object for each record, on one line."""

    def format(self, record: logging.LogRecord) -> str:
        import json  # most logs are text

        line = {
            "time": datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds"),
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": record.getMessage(),
            "program": program_name(),
            "pid": record.process,
            "thread": record.threadName,
        }
        if record.exc_info:
            line["exception"] = self.formatException(record.exc_info)
        return json.dumps(line, ensure_ascii=False)


def set_up_logging(settings: Settings) -> None:
    """Send the log records of this process to the destination in the settings.

    Raises ConfigurationException when the file cannot be written.
    """
    handler: logging.Handler = logging.StreamHandler()
    if settings.log_file:
        path = Path(settings.log_file.replace("{program}", program_name()).replace("{pid}", str(os.getpid())))
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            handler = rotating(path)
        except OSError as error:
            origin = settings.origins.get("log_file", "the program")
            raise ConfigurationException(
                f"{origin}: log_file = {settings.log_file!r}: cannot be written: {error.strerror}"
            ) from error
    text = logging.Formatter(_TEXT, _DATE)
    handler.setFormatter(_JsonFormatter() if settings.log_format == "json" else text)
    logging.basicConfig(level=settings.log_level.upper(), handlers=[handler], force=True)


def rotating(path: Path) -> RotatingFileHandler:
    """Return a handler that appends to a file of at most 10 MB and keeps five older ones.

    Raises OSError when the file cannot be opened.
    """
    from logging.handlers import RotatingFileHandler  # takes long to load, and most programs log to stderr

    return RotatingFileHandler(
        path, maxBytes=_MOST_BYTES, backupCount=_OLD_FILES, encoding="utf-8", errors="replace"
    )
