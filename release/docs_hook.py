"""A hook of mkdocs: the API reference, and files outside docs/ that pages link to, come into the site."""

from __future__ import annotations

import posixpath
import re
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File

from release.api import PACKAGES, page, page_name

ROOT = Path(__file__).parents[1]
SOURCE = "source"
"""Where the site has files from outside docs/."""
PAGES = ("CONTRIBUTING.md", "SECURITY.md", "CODE_OF_CONDUCT.md", "CHANGELOG.md")
"""Of the repository's own folder; all other files from outside docs/ are shown as text."""
_LINK = re.compile(r"(\]\()(?!https?:|mailto:|#)([^)#\s]+)")


def on_files(files: Any, config: Any, **_: Any) -> Any:
    """Add what is linked from docs/ and from PAGES, and the API reference."""
    wanted = {name for name in PAGES if (ROOT / name).exists()}
    texts = [(f"docs/{f.src_uri}", f.content_string) for f in files if f.src_uri.endswith(".md")]
    texts += [(name, (ROOT / name).read_text(encoding="utf-8")) for name in sorted(wanted)]
    for place, text in texts:
        for found in _LINK.finditer(text):
            target = _repository_path(place, found[2])
            if not target.startswith("docs/") and (ROOT / target).is_file():
                wanted.add(target)
    for name in sorted(wanted):
        content = (ROOT / name).read_text(encoding="utf-8")
        files.append(File.generated(config, _site_path(name), content=content))
    for package in PACKAGES:
        files.append(File.generated(config, page_name(package), content=page(package)))
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Turn links to files of the repository into links to where the site has them; what it has not is no link."""
    here = page.file.src_uri
    place = here.removeprefix(f"{SOURCE}/") if here.startswith(f"{SOURCE}/") else f"docs/{here}"

    def follow(found: re.Match[str]) -> str:
        target = _repository_path(place, found[2])
        return found[1] + posixpath.relpath(_site_path(target), posixpath.dirname(here) or ".")

    return _LINK.sub(follow, _without_folders(markdown, place))


def _without_folders(markdown: str, place: str) -> str:
    def text_alone(found: re.Match[str]) -> str:
        return found[1] if (ROOT / _repository_path(place, found[2])).is_dir() else found[0]

    return re.sub(r"\[([^]\[]+)\]\((?!https?:|mailto:|#)([^)#\s]+)\)", text_alone, markdown)


def _repository_path(place: str, link: str) -> str:
    return posixpath.normpath(posixpath.join(posixpath.dirname(place), link))


def _site_path(name: str) -> str:
    if name.startswith("docs/"):
        return name.removeprefix("docs/")
    return f"{SOURCE}/{name}" if name in PAGES else f"{SOURCE}/{name}.txt"
