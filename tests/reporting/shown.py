"""What a page shows: its text, by the classes of the elements that it stands in."""

from __future__ import annotations

from html.parser import HTMLParser

from hvcpd.reporting.markup import VOID


class Shown(HTMLParser):
    """`texts` has (classes of all elements around, text) in the page's order, but for scripts and styles."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.texts: list[tuple[str, str]] = []
        self._open: list[tuple[str, str]] = []
        self._whole: list[tuple[str, list[str]]] = []
        self._within: list[tuple[int, list[str]]] = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag in VOID:
            return
        kind = dict(attrs).get("class") or ""
        self._open.append((tag, kind))
        whole: list[str] = []
        self._whole.append((kind, whole))
        self._within.append((len(self._open), whole))

    def handle_endtag(self, tag: str) -> None:
        self._within = [(depth, whole) for depth, whole in self._within if depth < len(self._open)]
        self._open.pop()

    def handle_data(self, data: str) -> None:
        if not data.strip() or any(tag in ("script", "style") for tag, _ in self._open):
            return
        self.texts.append(("/".join(kind for _, kind in self._open), data))
        for _, whole in self._within:
            whole.append(data.strip())

    def of_class(self, wanted: str) -> list[str]:
        """The text of each element of that class."""
        return [" ".join(whole) for kind, whole in self._whole if wanted in kind.split()]
