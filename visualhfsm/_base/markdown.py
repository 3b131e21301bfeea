"""Markdown as a tree of elements, which the page makes one by one: no text in it is read as HTML."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple

from markdown_it import MarkdownIt
from markdown_it.tree import SyntaxTreeNode


class Element(NamedTuple):
    """An element: its tag, one of a few that are harmless, its attributes, and its content."""

    tag: str
    attributes: dict[str, str]
    content: list[Element | str]


_WEB: Final = ("http://", "https://", "mailto:")
_BELOW: Final = 2
"""Levels of headings of the page above those of a text."""
_LOWEST: Final = 6


def markdown(text: str, picture: Callable[[str], str]) -> list[Element | str]:
    """Return the elements of a text; `picture` returns the address of a picture that it names, "" for none.

    HTML in it is text, a link leads to the web or nowhere.
    """
    root = SyntaxTreeNode(MarkdownIt("js-default").parse(text))  # which nests at most 20 levels

    def content(node: SyntaxTreeNode) -> list[Element | str]:
        return [each for child in node.children for each in elements(child)]

    def elements(node: SyntaxTreeNode) -> list[Element | str]:
        match node.type:
            case "text" | "html_inline" | "html_block":
                return [node.content]
            case "softbreak":
                return ["\n"]
            case "code_inline":
                return [Element("code", {}, [node.content])]
            case "code_block" | "fence":
                return [Element("pre", {}, [Element("code", {}, [node.content])])]
            case "heading":
                return [Element(f"h{min(int(node.tag[1]) + _BELOW, _LOWEST)}", {}, content(node))]
            case "image":
                words = "".join(child.content for child in node.children)
                address = picture(str(node.attrs["src"]))
                return [Element("img", {"src": address, "alt": words}, [])] if address else [words]
            case "link":
                href = str(node.attrs["href"])
                return (
                    [Element("a", {"href": href}, content(node))] if href.startswith(_WEB) else content(node)
                )
            case "ordered_list":
                return [Element("ol", {"start": str(node.attrs.get("start", 1))}, content(node))]
            case "inline":
                return content(node)
            case "paragraph" if node.hidden:  # in a list without empty lines
                return content(node)
        return [Element(node.tag, {}, content(node) if node.children else [])]

    return content(root)
