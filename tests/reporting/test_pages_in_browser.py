"""The pages as a browser lays them out: nothing overlaps, nothing sticks out, on a desk and on a phone."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.keys import Keys

from hvcpd.language.card import make_card
from hvcpd.reporting.card_page import card_page
from hvcpd.reporting.events import MissionRecord, Started
from hvcpd.reporting.html import page as report_page
from hvcpd.reporting.shift import read_shift
from hvcpd.reporting.shift_page import page as shift_page
from tests.console.browser import MISSING, WHY, chromium, faults, look_like, until
from tests.reporting.example import example
from tests.reporting.shift_example import flower_tasks, made_up
from tests.reporting.shown import Page

pytestmark = [pytest.mark.slow, pytest.mark.skipif(MISSING, reason=WHY)]

SIX = ("Rob", "Bot", "Zoe", "Kira", "Omar", "Ada")
LONG_NAMES = ("Maximilian", "Bartholomew", "Wilhelminachristi")
LONG = "carry the enormously heavy wooden storage container"
A4_MM = 297.0
MM_PER_PX = 25.4 / 96
OVERLAPS = """
const kinds = 'svg.timeline text, .times span, .names div, dt, dd, td, tbody th, .legend span';
const shown = [...document.querySelectorAll(kinds)]
  .map((e) => [e.closest('.timeline, .talk-chart, .names, .figures, table, p'), e, e.getBoundingClientRect()])
  .filter(([, , box]) => box.width > 0 && box.height > 0);
const found = [];
for (let a = 0; a < shown.length; a += 1)
  for (let b = a + 1; b < shown.length; b += 1) {
    const [home, one, p] = shown[a], [other, two, q] = shown[b];
    const wide = Math.min(p.right, q.right) - Math.max(p.left, q.left);
    const high = Math.min(p.bottom, q.bottom) - Math.max(p.top, q.top);
    if (home === other && !one.contains(two) && !two.contains(one) && wide > 1 && high > 1)
      found.push([one.textContent, two.textContent]);
  }
return found;
"""
"""Pairs of texts in one part of the page that lie over each other."""
OUT_OF_BARS = """
return [...document.querySelectorAll('.span')].flatMap((span) => {
  const bar = span.querySelector('rect').getBoundingClientRect(), text = span.querySelector('text');
  const marks = [...document.querySelectorAll('.carried-out circle')].map((mark) => mark.getBoundingClientRect());
  if (!text) return [];
  const box = text.getBoundingClientRect();
  const hit = marks.some((m) => m.left < box.right && m.right > box.left && m.top < box.bottom && m.bottom > box.top);
  return box.right > bar.right || hit ? [text.textContent] : [];
});
"""
"""Labels of the timeline that reach out of their bars, or into the mark of a task that was carried out."""

BROKEN_WORDS = """
const lines = (node, found) => {
  const range = document.createRange();
  range.setStart(node, found.index), range.setEnd(node, found.index + found[0].length);
  return new Set([...range.getClientRects()].map((box) => Math.round(box.top))).size;
};
return [...document.querySelectorAll(arguments[0])].flatMap(({firstChild: node}) =>
  [...node.data.matchAll(/\\S+/g)].filter((found) => lines(node, found) > 1).map((found) => found[0])
);
"""
"""Words of the elements that a selector finds, each with one text, that run over two lines."""
HEADINGS = "thead th"


ROOM_BELOW = """
const bottom = (element) => element.getBoundingClientRect().bottom;
return [...document.querySelectorAll('.pocket')].map((card) => bottom(card) - bottom(card.lastElementChild));
"""


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with chromium() as driver:
        yield driver


def opened(browser: Any, page: str, folder: Path) -> None:
    (folder / "page.html").write_text(page, encoding="utf-8")
    browser.get((folder / "page.html").as_uri())


SHIFTS = {
    "alone": (SIX[:1], flower_tasks(3), 3.0),
    "two": (SIX[:2], flower_tasks(12), 20.0),
    "six": (SIX, flower_tasks(30), 20.0),
    "days": (SIX, flower_tasks(40), 900.0),
    "long names": (LONG_NAMES, flower_tasks(6, LONG), 20.0),
}


@pytest.mark.parametrize("case", SHIFTS)
def test_the_report_of_a_shift(case: str, browser: Any, tmp_path: Path) -> None:
    names, tasks, pause_s = SHIFTS[case]
    made = made_up(names, tasks, pause_s=pause_s)
    shift = read_shift(made.rows, made.book, made.tasks, (made.rows[0].wall_s or 0.0, made.end_s))
    opened(browser, shift_page(shift), tmp_path)
    for width, scheme in ((1280, "light"), (390, "dark")):
        look_like(browser, width, 900, scheme, phone=width < 500)
        assert browser.execute_script("return document.documentElement.scrollWidth") <= width
        assert browser.execute_script(OVERLAPS) == []
        names_on_desk = ", .names div" if width > 500 else ""  # "somebod-y"
        assert browser.execute_script(BROKEN_WORDS, HEADINGS + names_on_desk) == []
        assert browser.execute_script(OUT_OF_BARS) == []
        assert faults(browser) == []


def test_the_report_of_a_mission_in_another_domain(browser: Any, tmp_path: Path) -> None:
    names = ("shelve the history books", "dust the upper shelf", "carry the atlas", "inspect the reading room")
    record = _with_icons(
        example(task_names=names, title="A library", sound=False), ((1, "book"), (2, "shelf"), (3, "★"))
    )
    text = report_page(record)
    for word in ("plant", "flower", "water", "blossom", "petal"):
        assert word not in " ".join(Page(text).text).replace("team plant", ""), word
    opened(browser, text, tmp_path)
    for width in (1280, 390):
        look_like(browser, width, 900, "light", phone=width < 500)
        assert browser.execute_script(OVERLAPS) == []
        assert browser.execute_script(BROKEN_WORDS, HEADINGS) == []
        assert browser.execute_script("return document.querySelectorAll('.heart').length") == 0
        assert browser.execute_script("return document.documentElement.scrollWidth") <= width


def _with_icons(record: MissionRecord, icons: tuple[tuple[int, str], ...]) -> MissionRecord:
    started = next(event for event in record.events if isinstance(event, Started))
    return replace(record, events=tuple(replace(e, icons=icons) if e is started else e for e in record.events))


CARDS = {
    "five": (SIX[:2], flower_tasks(5)),
    "six tasks": (SIX, flower_tasks(6)),
    "twelve": (SIX[:2], flower_tasks(12)),
    "thirty": (SIX[:2], flower_tasks(30)),
    "thirty long": ((*LONG_NAMES, *SIX), flower_tasks(30, LONG)),
    "five long": (LONG_NAMES, flower_tasks(5, LONG)),
}


@pytest.mark.parametrize("case", CARDS)
def test_the_cards_have_room_for_all_that_stands_on_them(case: str, browser: Any, tmp_path: Path) -> None:
    names, tasks = CARDS[case]
    opened(browser, card_page(make_card(made_up(names, tasks).book), tasks), tmp_path)
    look_like(browser, 820, 900)
    assert min(browser.execute_script(ROOM_BELOW)) > 0
    high = "return [...document.querySelectorAll('.sheet')].map((sheet) => sheet.getBoundingClientRect().height)"
    assert max(browser.execute_script(high)) * MM_PER_PX <= A4_MM
    look_like(browser, 390, 900, "dark", phone=True)
    assert browser.execute_script("return document.documentElement.scrollWidth") <= 390
    assert faults(browser) == []


def test_a_report_is_played_by_keyboard_with_three_keys(browser: Any, tmp_path: Path) -> None:
    file = tmp_path / "report.html"
    file.write_text(report_page(example()), encoding="utf-8")
    look_like(browser, 1280, 900, "light")
    browser.get(file.as_uri())
    ActionChains(browser).send_keys(Keys.TAB, Keys.ENTER).perform()
    until(lambda: browser.switch_to.active_element.get_attribute("id") == "whole")
    ActionChains(browser).send_keys(Keys.ENTER).perform()
    until(lambda: not browser.execute_script("return document.getElementById('sound').paused"))
    ActionChains(browser).send_keys(Keys.ENTER).perform()


def test_a_report_is_played_fast_and_its_map_follows(browser: Any, tmp_path: Path) -> None:
    file = tmp_path / "report.html"
    file.write_text(report_page(example()), encoding="utf-8")
    look_like(browser, 390, 844, "dark", phone=True)
    browser.get(file.as_uri())
    undone = "return document.querySelectorAll('.place.undone').length"
    done = browser.execute_script("return document.querySelectorAll('.place[data-done]').length")
    assert done > 0
    assert browser.execute_script(undone) == 0
    browser.find_element("id", "speed").send_keys("4")
    browser.find_element("id", "whole").send_keys("\ue007")
    until(lambda: browser.execute_script(undone) == done)
    assert browser.execute_script("return document.getElementById('sound').playbackRate") == 4
    browser.find_element("id", "whole").send_keys("\ue007")
    assert faults(browser) == []


@pytest.mark.parametrize("width", [390, 1280])
def test_play_brings_the_map_into_view_and_no_caption_is_cut_off(width: int, browser: Any, tmp_path: Path) -> None:
    file = tmp_path / "report.html"
    file.write_text(report_page(example()), encoding="utf-8")
    look_like(browser, width, 844, "light", phone=width == 390)
    browser.get(file.as_uri())
    browser.find_element("id", "whole").send_keys("\ue007")
    top = "return document.querySelector('.map').getBoundingClientRect().top"
    until(lambda: 0 <= browser.execute_script(top) < 200)
    caption = browser.find_element("id", "caption")
    until(lambda: caption.text.startswith("Rob: "))
    said = browser.execute_script("return [...document.querySelectorAll('.said p')].map((p) => p.textContent)")
    fits = "const [c, text] = arguments; c.textContent = text; return c.scrollWidth <= c.clientWidth"
    assert browser.execute_script(fits, caption, f"Rob: {max(said, key=len)}")
    browser.find_element("id", "whole").send_keys("\ue007")
