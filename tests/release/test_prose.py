"""The check of plain English."""

from __future__ import annotations

import pytest

from release.prose import code_faults, faults, pages, words_a_sentence


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("It works.\nIt works all the same.\n", [(2, "“all the same”: write anyway, still, or nothing")]),
        ("It is recognised.\n", []),
        ("It works. Who hears it halts.\n", [(1, "“Who …” as a subject: write “a robot that …”, “people who …”")]),
        ("## Who hears it\n\n| who hears it |\n\nWho hears it?\n", []),
        ("It takes some 5 s, or some time.\n", [(1, "“some”: write about")]),
        ("It mends what was mended.\n", [(1, "“mend”: write fix")]),
        ("word " * 31 + ".\n", [(1, "sentences have 31 words on average; at most 30 can be read with ease")]),
    ],
)
def test_what_reads_badly_is_found_with_its_line(text: str, found: list[tuple[int, str]]) -> None:
    assert list(faults(text)) == found


def test_code_tables_and_headings_are_no_prose() -> None:
    text = "# A b c d e f\n\nOne two three. Four five.\n\n    code code code code\n\n| a | b |\n\n```\nmore code\n```\n"
    assert words_a_sentence(text) == 2.5


def test_all_pages_pass() -> None:
    assert {path.name: list(faults(path.read_text(encoding="utf-8"))) for path in pages()} == {
        path.name: [] for path in pages()
    }


def test_comments_that_continue_the_one_above_are_found() -> None:
    code = 'A = 1\n"""The first..."""\nB = 2\n"""...and the second."""\nC = 3\n"""So many."""\n"""So many of them."""\n'
    assert [number for number, _ in code_faults(code)] == [4, 7]
