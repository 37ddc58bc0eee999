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


def figure_list(figures: Iterable[tuple[str, str]]) -> Markup:
    """The main figures of a report: each a value and what it is."""
    return tag("dl", *(tag("div", tag("dt", what), tag("dd", value)) for value, what in figures), class_="figures")


def document(title: str, style: Markup, *body: Child, policy: str | None = None) -> str:
    """A whole HTML page that needs nothing else, with its content security policy, if it has one."""
    head = (
        tag("meta", charset="utf-8"),
        tag("meta", http_equiv="Content-Security-Policy", content=policy) if policy is not None else None,
        tag("meta", name_="viewport", content="width=device-width, initial-scale=1"),
        tag("title", title),
        tag("style", style),
    )
    return f"<!doctype html>\n{tag('html', tag('head', *head), tag('body', *body), lang='en')}\n"


def security_policy(script: str, more: str = "") -> str:
    """A content security policy: a page loads nothing but what `more` allows, and runs no script but this one."""
    fingerprint = base64.b64encode(hashlib.sha256(script.encode("utf-8")).digest()).decode("ascii")
    return f"default-src 'none'; style-src 'unsafe-inline'; {more}script-src 'sha256-{fingerprint}'"
