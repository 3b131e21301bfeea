"""Split doc comments into plain text: the description, parameters, return value and exceptions."""

from __future__ import annotations

import html
import re
from dataclasses import dataclass, field
from functools import lru_cache

_LEADING_STAR = re.compile(r"^[ \t]*\*+(?!/)[ \t]?", re.MULTILINE)
_INLINE_TAG = re.compile(r"\{@\w+\s+([^{}]*)\}")
_HTML_TAG = re.compile(r"</?[A-Za-z][A-Za-z0-9]*(?:\s[^<>]*)?/?>")
_PARAGRAPH_TAG = re.compile(r"<(?:p|br|li|ul|ol|dl|dt|dd)\b[^<>]*>", re.IGNORECASE)
_LAYOUT = str.maketrans("", "", "\n\t")
# Any tag at the start of a line, and in the middle only those that cannot be text.
_BLOCK_TAG = re.compile(
    r"""(?: ^[ \t]*[@\\](?=\w) | (?<=[ \t])@(?=(?:param|returns?|throws?|exception|see|deprecated)\b) )
        (\w+)[ \t]*""",
    re.MULTILINE | re.VERBOSE,
)
_IGNORED_TAGS = frozenset({"author", "date", "file", "ingroup", "since", "version"})


@dataclass(frozen=True, slots=True)
class DocComment:
    """The parts of a doc comment; empty lines separate the paragraphs of each part."""

    text: str = ""
    parameters: dict[str, str] = field(default_factory=dict)
    returns: str = ""
    throws: dict[str, str] = field(default_factory=dict)


@lru_cache(maxsize=4096)  # the writer and the schema use the same comments
def parse_doc_comment(raw: str | None) -> DocComment:
    """Return the parts of a raw doc comment; all are empty for None."""
    if raw is None:
        return DocComment()
    text = _LEADING_STAR.sub("", raw.replace("\r", "")) if "\n" in raw else raw
    # [text, tag, body, tag, body, ...]
    pieces = _BLOCK_TAG.split(text)
    main = [pieces[0]]
    parameters: dict[str, str] = {}
    throws: dict[str, str] = {}
    returns = ""
    for tag, body in zip(pieces[1::2], pieces[2::2], strict=True):
        name, *rest = body.split(maxsplit=1) or [""]
        if tag == "param" and name:
            parameters[name] = _clean(" ".join(rest))
        elif tag in {"throws", "throw", "exception"} and name:
            throws[name] = _clean(" ".join(rest))
        elif tag in {"return", "returns"}:
            returns = _clean(body)
        elif tag == "see":
            main.append(f"See {body}")
        elif tag in {"brief", "details", "note", "remark", "remarks"}:
            main.append(body)
        elif tag == "deprecated":
            main.append(f"Deprecated. {body}")
        elif tag not in _IGNORED_TAGS:
            main[-1] += f"{tag} {body}"
    paragraphs = [cleaned for part in main if (cleaned := _clean(part))]
    return DocComment("\n\n".join(paragraphs), parameters, returns, throws)


def _clean(text: str) -> str:
    """Return text without markup, one line per paragraph, with empty lines between them."""
    text = _INLINE_TAG.sub(lambda match: match[1].strip().lstrip("#").replace("#", "."), text)
    text = _PARAGRAPH_TAG.sub("\n\n", text)
    text = html.unescape(_HTML_TAG.sub("", text))
    if not text.translate(_LAYOUT).isprintable():
        text = "".join(character for character in text if character.isprintable() or character in "\n\t")
    paragraphs = [" ".join(paragraph.split()) for paragraph in re.split(r"\n[ \t]*\n", text)]
    return "\n\n".join(paragraph for paragraph in paragraphs if paragraph)
