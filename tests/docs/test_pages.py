"""The documentation: links lead somewhere, examples run, and the reference is what the code says."""

from __future__ import annotations

import doctest
import re
from pathlib import Path

import pytest
import yaml

from hvcpd.config.task_file import load_tasks
from hvcpd.language.phrasebook import Phrasebook, Vocabulary
from release import api
from release.reference import FOLDER, PAGES, settings

ROOT = Path(__file__).parents[2]
MKDOCS = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
TEXTS = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])
LINK = re.compile(r"\]\((?!https?:|mailto:)([^)\s]*)\)")
FENCED = re.compile(r"^```.*?^```$|^    [^\n]*$|`[^`\n]+`", re.M | re.S)
EXAMPLE = re.compile(r"<!-- own \w+ -->\n +```yaml\n(.*?)```", re.S)


def linked(path: Path) -> list[str]:
    """The files and anchors that a page links to."""
    return LINK.findall(FENCED.sub("", path.read_text(encoding="utf-8")))


def anchors(path: Path) -> set[str]:
    """The anchors of a page: its own, and those of headings, as GitHub and mkdocs make them of plain words."""
    text = path.read_text(encoding="utf-8")
    heads = re.findall(r"^#+ +(.+)$", text, re.M)
    plain = (re.sub(r"\[([^]]*)\]\([^)]*\)|[`*]", r"\1", head) for head in heads)
    own = re.findall(r'<a id="([^"]+)">', text)
    return {*own, *(re.sub(r"[^\w\- ]", "", head.lower()).strip().replace(" ", "-") for head in plain)}


def test_every_page_is_linked_from_another_one() -> None:
    links = {(path, (path.parent / link.partition("#")[0]).resolve()) for path in TEXTS for link in linked(path)}
    found = {target for path, target in links if target != path}
    pages = {path for path in TEXTS if path.is_relative_to(ROOT / "docs")}
    assert pages - found == set()


@pytest.mark.parametrize("path", TEXTS, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_every_link_leads_somewhere(path: Path) -> None:
    for link in linked(path):
        file, _, anchor = link.partition("#")
        target = (path.parent / file).resolve() if file else path
        assert target.exists(), link
        assert not anchor or target.suffix != ".md" or anchor in anchors(target), link


@pytest.mark.parametrize("name", PAGES)
def test_the_reference_is_what_the_code_says(name: str) -> None:
    text = (FOLDER / f"{name}.md").read_text(encoding="utf-8")
    assert text == PAGES[name](), "run `python -m release.reference`"


@pytest.mark.parametrize(
    ("key", "begins"),
    [
        ("pitch", "Factors on"),
        ("speech.rate", "normal or slow: a quarter longer."),  # there is a `rate` without a group, too
        ("mode", "volunteer: the robot picks"),
        ("wheels.driver", "opencr: a stock TurtleBot3's controller; dynamixel: two"),
    ],
)
def test_each_setting_has_the_whole_comment_of_the_example_file(key: str, begins: str) -> None:
    section = settings().partition(f"## `{key}`\n\n")[2].split("\n\n")
    assert section[1].startswith(begins)


@pytest.mark.slow
def test_the_examples_in_python_run() -> None:
    found = doctest.testfile(str(FOLDER / "python.md"), module_relative=False)
    assert found.attempted >= 25
    assert found.failed == 0


@pytest.mark.parametrize("page", ["own-tasks", "own-skill"])
def test_the_tutorials_task_files_are_right(page: str, tmp_path: Path) -> None:
    text = (ROOT / "docs" / "tutorials" / f"{page}.md").read_text(encoding="utf-8")
    [example] = EXAMPLE.findall(text)
    file = tmp_path / "tasks.yaml"
    file.write_text(re.sub(r"^    ", "", example, flags=re.M))
    assert load_tasks(file).tasks


def test_every_page_is_in_the_sites_navigation() -> None:
    text = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    named = re.findall(r": ([\w/-]+\.md)$|- ([\w/-]+\.md)$", text, re.M)
    shown = {first or second for first, second in named}
    assert {path.relative_to(ROOT / "docs").as_posix() for path in (ROOT / "docs").rglob("*.md")} <= shown
    assert yaml.safe_load(text)["theme"]["font"] is False  # nothing is loaded from elsewhere


def test_the_api_reference_has_what_the_code_has() -> None:
    pages = {package: api.page(package) for package in api.PACKAGES}
    language = pages["hvcpd/language"]
    assert "### Phrasebook\n" in language
    assert "#### Phrasebook.parse_text\n" in language
    assert "self" not in re.findall(r"^def parse_text\((\w+)", language, re.M)
    for package, text in pages.items():
        assert f"      - API of {package.rpartition('/')[2]}: {api.page_name(package)}\n" in MKDOCS
        assert not re.findall(r"^(?:class|def|async def) _", text, re.M)


def test_a_robot_that_is_installed_from_its_source_gets_every_unit() -> None:
    text = (ROOT / "docs" / "install.md").read_text(encoding="utf-8")
    units = {path.name for path in (ROOT / "systemd").iterdir()} - {"hvcpd-user.service"}  # a desktop's
    assert len(units) == 6
    assert {unit for unit in units if f"systemd/{unit}" not in text} == set()


def test_robots_understand_what_the_page_about_talking_has_people_and_robots_say() -> None:
    text = (ROOT / "docs" / "talking.md").read_text(encoding="utf-8")
    tasks = tuple(f"water the {colour} rose" for colour in ("yellow", "indigo"))
    names = ("Rob", "Bot", "Max", "Anna")
    book = Phrasebook(Vocabulary(names, ("plant",), tasks, tuple(range(1, 7)), places=("corridor",)))
    said = set(re.findall(r'"((?:Hi|Rob,|What|Who|all,|all|Rob) [^"…]+)"', " ".join(text.split())))
    assert len(said) > 25
    for sentence in said:
        assert book.parse_text(sentence.partition(", code ")[0]), sentence
