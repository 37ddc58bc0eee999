"""A page, read strictly: its elements, and what it shows."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from html.parser import HTMLParser

from hvcpd.reporting.markup import VOID


@dataclass(eq=False)
class Element:
    """`path`: the elements around it, the outermost first. `parts`: the texts that it shows."""

    tag: str
    attributes: dict[str, str | None]
    path: tuple[Element, ...]
    parts: list[str] = field(default_factory=list)

    def is_of(self, kind: str) -> bool:
        """Whether it has that class."""
        return kind in (self.attributes.get("class") or "").split()


class Page(HTMLParser):
    """Every end tag must close the element that is open, and no attribute stands twice. `text` is all that is shown."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.elements: list[Element] = []
        self.text: list[str] = []
        self._open: tuple[Element, ...] = ()
        self.feed(text)
        self.close()
        assert self._open == ()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        assert len({name for name, _ in attrs}) == len(attrs), f"an attribute twice in {tag}"
        self.elements.append(Element(tag, dict(attrs), self._open))
        if tag not in VOID:
            self._open += (self.elements[-1],)

    def handle_endtag(self, tag: str) -> None:
        assert self._open, f"</{tag}> closes nothing"
        assert self._open[-1].tag == tag
        self._open = self._open[:-1]

    def handle_data(self, data: str) -> None:
        if self._open and self._open[-1].tag not in ("script", "style"):
            self.text.append(data)
            for element in self._open:
                element.parts.append(data)

    def all(self, tag: str) -> list[dict[str, str | None]]:
        """The attributes of each element of that name."""
        return [each.attributes for each in self.elements if each.tag == tag]

    def of_class(self, wanted: str) -> list[dict[str, str | None]]:
        """The attributes of each element of that class."""
        return [each.attributes for each in self.elements if each.is_of(wanted)]

    def shown(self, wanted: str) -> list[str]:
        """The text of each element of that class."""
        return [" ".join(map(str.strip, each.parts)) for each in self.elements if each.is_of(wanted)]

    def rows(self) -> Iterator[list[str]]:
        """The texts of each table's row, cell by cell; items of a list in a cell have "; " behind them."""
        for row in self.elements:
            if row.tag == "tr":
                cells = [each for each in self.elements if each.path[-1:] == (row,)]
                items = [[i for i in self.elements if i.tag == "li" and cell in i.path] for cell in cells]
                yield [
                    "".join(cell.parts) if not listed else "".join(f"{''.join(item.parts)}; " for item in listed)
                    for cell, listed in zip(cells, items, strict=True)
                ]
