"""A page in Markdown as plain values that the browser makes elements of.

Sections of blocks, blocks of spans.
"""

import base64
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from markdown_it import MarkdownIt
from markdown_it.token import Token

Json = dict[str, Any]
Span = list[str]  # style and text

STYLES = {"strong_open": "b", "em_open": "i"}
LISTS = ("bullet_list_open", "ordered_list_open")


def sections(text: str, folder: Path) -> tuple[str, list[Json]]:
    """The title of a page, and its sections: a heading and blocks each.

    What comes first has no heading.

    Args:
        text: the page, with headings of three levels, paragraphs, lists, tables, pictures and code.
        folder: where its pictures are.
    """
    title = ""
    found: list[Json] = [{"title": "", "blocks": []}]
    tokens = iter(MarkdownIt("commonmark").enable("table").parse(text))
    for token in tokens:
        if token.type != "heading_open":
            found[-1]["blocks"] += _block(token, tokens, folder)
            continue
        heading = _plain(next(tokens))
        if token.tag == "h1":
            title = heading
        elif token.tag == "h2":
            found.append({"title": heading, "blocks": []})
        else:
            found[-1]["blocks"].append({"kind": "heading", "text": heading})
    return title, [each for each in found if each["blocks"]]


def _block(token: Token, tokens: Iterator[Token], folder: Path) -> list[Json]:
    """The block that a token begins, as far as the page shows such."""
    if token.type in ("fence", "code_block"):
        return [{"kind": "code", "text": token.content}]
    if token.type == "table_open":
        return [_table(tokens)]
    if token.type in LISTS:
        return [{"kind": "list", "items": [_spans(each) for each in _inlines(token, tokens)]}]
    if token.type == "inline":
        pictures = [child for child in token.children or () if child.type == "image"]
        if pictures:
            return [_picture(each, folder) for each in pictures]
        return [{"kind": "text", "spans": _spans(token)}]
    return []


def _inlines(opened: Token, tokens: Iterator[Token]) -> Iterator[Token]:
    """The texts up to the end of what a token opens."""
    for token in tokens:
        if token.type == opened.type.replace("_open", "_close") and token.level == opened.level:
            return
        if token.type == "inline":
            yield token


def _table(tokens: Iterator[Token]) -> Json:
    """Cells row by row, the first row that of the heads; which columns stand to the right."""
    rows: list[list[list[Span]]] = []
    right: list[bool] = []
    for token in tokens:
        if token.type == "table_close":
            break
        if token.type == "tr_open":
            rows.append([])
        elif token.type == "th_open":
            right.append("right" in str(token.attrGet("style") or ""))
        elif token.type == "inline":
            rows[-1].append(_spans(token))
    return {"kind": "table", "head": rows[0], "rows": rows[1:], "right": right}


def _spans(token: Token) -> list[Span]:
    """Pieces of text, each with its style: b, i, code, or none."""
    found: list[Span] = []
    style = ""
    for child in token.children or ():
        if child.type in STYLES:
            style = STYLES[child.type]
        elif child.type in ("strong_close", "em_close"):
            style = ""
        elif child.type == "code_inline":
            found.append(["code", child.content])
        elif child.type in ("softbreak", "hardbreak"):
            found.append([style, " "])
        elif child.content:
            found.append([style, child.content])
    return found


def _plain(token: Token) -> str:
    return "".join(text for _, text in _spans(token))


def _picture(token: Token, folder: Path) -> Json:
    """A picture of the folder, whole; its text alone where it is not there."""
    file = folder / str(token.attrGet("src"))
    about = token.content
    if file.suffix != ".png" or not file.is_file():
        return {"kind": "text", "spans": [["i", about]]}
    data = base64.b64encode(file.read_bytes()).decode()
    return {"kind": "picture", "data": f"data:image/png;base64,{data}", "text": about}
