"""HTML and SVG elements: every string is escaped but markupsafe's `Markup`; nothing from outside is read as markup."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Iterable

from markupsafe import Markup, escape

from hvcpd.reporting.text import clean, number

VOID = frozenset("meta link br img input hr".split())
"""HTML's elements without an end tag (of those that we use)."""


Child = str | float | None


def escaped(text: str) -> Markup:
    """Any text as markup that shows it."""
    return text if isinstance(text, Markup) else escape(clean(text))


def joined(parts: Iterable[str], between: str = "") -> Markup:
    """Parts one after the other, each escaped unless it is markup."""
    return Markup(between.join(map(escaped, parts)))


def tag(name: str, *children: Child, **attributes: str | float | bool | None) -> Markup:
    """An element. In attributes' names a trailing _ is dropped and others become -; None and False leave one out."""
    written = [name]
    for key, value in attributes.items():
        if value is None or value is False:
            continue
        key = key.rstrip("_").replace("_", "-")
        text = number(value) if isinstance(value, int | float) else escape(clean(value))
        written.append(key if value is True else f'{key}="{text}"')
    opening = f"<{' '.join(written)}>"
    if name in VOID:
        return Markup(opening)
    content = (escaped(number(c) if isinstance(c, int | float) else c) for c in children if c is not None)
    return Markup(f"{opening}{''.join(content)}</{name}>")


def table(heads: Iterable[str], rows: Iterable[Markup]) -> Markup:
    """A table with these heads over its columns."""
    head = tag("thead", tag("tr", *(tag("th", each, scope="col") for each in heads)))
    return tag("table", head, tag("tbody", *rows))


def row(heads: Iterable[str], cells: Iterable[Child], name: int = 0, class_: str | None = None) -> Markup:
    """A row of a table with these heads. The cell at `name` says what the row is of; on a phone each of the others has
    its column's head before it."""
    parts = [
        tag("th", cell, scope="row")
        if k == name
        else tag("td", cell, data_head=head, class_="no" if head == "No." else None)
        for k, (head, cell) in enumerate(zip(heads, cells, strict=True))
    ]
    return tag("tr", *parts, class_=class_)


def figure_list(figures: Iterable[tuple[str, str]]) -> Markup:
    """The main figures of a report: each a value and what it is."""
    return tag("dl", *(tag("div", tag("dt", what), tag("dd", value)) for value, what in figures), class_="figures")


def document(title: str, style: Markup, *body: Child, script: str = "", loads: str = "") -> str:
    """A whole HTML page that needs nothing else.

    By its content security policy it loads nothing but what `loads` allows, and runs no script but this one.
    """
    policy = f"default-src 'none'; style-src 'unsafe-inline'; {loads}"
    if script:
        fingerprint = base64.b64encode(hashlib.sha256(script.encode("utf-8")).digest()).decode("ascii")
        policy += f"script-src 'sha256-{fingerprint}'"
        body = (*body, tag("script", Markup(script)))
    head = (
        tag("meta", charset="utf-8"),
        tag("meta", http_equiv="Content-Security-Policy", content=policy),
        tag("meta", name_="viewport", content="width=device-width, initial-scale=1"),
        tag("title", title),
        tag("style", style),
    )
    return f"<!doctype html>\n{tag('html', tag('head', *head), tag('body', *body), lang='en')}\n"
