"""The messages on the websocket, as types: what does not fit them is refused before anything is done.

The page sends requests, `{"id": 1, "op": "undo", "tab": 2}`, and gets one answer for each,
`{"re": 1, "ok": 3}` or `{"re": 1, "error": "text", "kind": "kind"}`. What changes comes by itself as pushes,
`{"push": "kind"}`. Fields are in camelCase. docs/editor-protocol.md explains all of them with examples.
"""

from __future__ import annotations

from typing import Final

import msgspec

from .answers import Answer, ErrorAnswer, ErrorKind
from .pushes import (
    Closed,
    DocumentPush,
    Output,
    OutputLine,
    Outside,
    Problems,
    Push,
    Recoverable,
    RunPush,
    Snapshot,
    Stale,
    Structure,
    TabState,
    Workspace,
)
from .requests import (
    Attach,
    Close,
    Complete,
    Control,
    Copy,
    Cut,
    Detach,
    Diff,
    Discard,
    Do,
    Export,
    Generate,
    Hello,
    Imported,
    Interfaces,
    Lint,
    ListFiles,
    Locate,
    New,
    Open,
    OpenText,
    Paste,
    Recording,
    Recover,
    Redo,
    Request,
    Resolve,
    Run,
    Save,
    SaveAs,
    Seal,
    Search,
    Signature,
    StopRun,
    Undo,
    decode_request,
    request_id,
)

__all__ = [
    "Answer",
    "Attach",
    "Close",
    "Closed",
    "Complete",
    "Control",
    "Copy",
    "Cut",
    "Detach",
    "Diff",
    "Discard",
    "Do",
    "DocumentPush",
    "ErrorAnswer",
    "ErrorKind",
    "Export",
    "Generate",
    "Hello",
    "Interfaces",
    "Imported",
    "Lint",
    "ListFiles",
    "New",
    "Locate",
    "Open",
    "OpenText",
    "Output",
    "OutputLine",
    "Outside",
    "Paste",
    "Problems",
    "Push",
    "Recording",
    "Recover",
    "Recoverable",
    "Redo",
    "Request",
    "Resolve",
    "Run",
    "RunPush",
    "Save",
    "SaveAs",
    "Seal",
    "Search",
    "Signature",
    "Snapshot",
    "Stale",
    "StopRun",
    "Structure",
    "TabState",
    "Undo",
    "Workspace",
    "decode_request",
    "encode",
    "request_id",
]

_ENCODER: Final = msgspec.json.Encoder()


def encode(message: Answer | ErrorAnswer | Push) -> bytes:
    """Return the text of a message."""
    return _ENCODER.encode(message)
