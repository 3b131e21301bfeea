"""Markdown as elements that the page makes one by one: nothing in it is read as HTML."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from markdown_it import MarkdownIt
from markdown_it.tree import SyntaxTreeNode

_WEB: Final = ("http://", "https://", "mailto:")


def markdown(text: str, picture: Callable[[str], str]) -> list[Any]:
    """Return the content of a text: strings, and elements with tag, attributes and content.

    `picture` returns the address of a picture that it names, "" for none. HTML in it is text, a link leads to
    the web or nowhere, and headings stand below those of the page.
    """

    def words(node: SyntaxTreeNode) -> list[Any]:
        content = inside(node)
        href = str(node.attrs.get("href", ""))
        start = {"start": str(node.attrs["start"])} if "start" in node.attrs else {}
        match node.type:
            case "text" | "softbreak":
                return [node.content or "\n"]
            case "code_inline":
                return [("code", {}, [node.content])]
            case "code_block" | "fence":
                return [("pre", {}, [("code", {}, [node.content])])]
            case "heading":
                return [(f"h{min(int(node.tag[1]) + 2, 6)}", {}, content)]
            case "image":
                address = picture(str(node.attrs["src"]))
                return [("img", {"src": address, "alt": node.content}, [])] if address else content
            case "link" if href.startswith(_WEB):
                return [("a", {"href": href}, content)]
            case "inline" | "link":
                return content
            case "paragraph" if node.hidden:  # in a list without empty lines
                return content
        return [(node.tag, start, content)]

    def inside(node: SyntaxTreeNode) -> list[Any]:
        return [each for child in node.children for each in words(child)]

    return inside(SyntaxTreeNode(MarkdownIt("js-default").parse(text)))  # which nests at most 20 levels
