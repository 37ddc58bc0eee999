"""Files that are no good YAML, too large, or meant to hurt."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hvcpd.config.document import MAX_DEPTH, MAX_FILE_BYTES, MAX_VALUES, parse, read_bytes
from hvcpd.config.settings_file import load_settings
from hvcpd.errors import ConfigError


def fault(data: bytes) -> str:
    with pytest.raises(ConfigError) as error:
        parse(data, "F")
    return str(error.value)


def lesser_faults(text: str) -> list[str]:
    return list(parse(text.encode(), "F").faults())


def all_faults(data: bytes) -> list[str]:
    """The faults of a document, whether it could be read or not."""
    try:
        return list(parse(data, "F").faults())
    except ConfigError as error:
        return str(error).splitlines()


def test_a_syntax_error_names_its_line() -> None:
    assert fault(b"name: Rob\nteam: [a, b\nmode: x\n").startswith("F:2: not valid YAML")
    assert fault(b"a: 1\n\tb: 2\n").startswith("F:2: not valid YAML")
    assert "correct the line" in fault(b"a: [1,,2]\n")


@pytest.mark.parametrize(
    ("text", "line", "remedy"),
    [
        ("a: 1\nb:\n\t- x\n", 3, "use spaces in place of the tab"),
        ("a: water: rose\n", 1, "indent it as the lines around it; put text with a colon in quotes"),
        ("a: 1\n  b: 2\n", 2, "indent it as the lines around it; put text with a colon in quotes"),
        ("a:\n   b: 1\n  c: 2\n", 3, "indent it as the lines around it; write a quote within quotes twice"),
        ("a: 'rob's rose'\n", 1, "indent it as the lines around it; write a quote within quotes twice"),
        ("a: 1\nb:2\nc: 3\n", 2, "write a colon and a space after the key"),
        ("a: 1\nb: 'x\nc: 3\n", 2, "close the quote"),
        ("a: 1\nb: {x: 1\nc: 3\n", 2, "close the brace; put text with a colon or # in quotes"),
        ("a: @rob\n", 1, "put the text in quotes"),
        ("a: *rob\n", 1, "put the text in quotes"),
        ("a: 1\nb: *nothing\n", 2, "put the text in quotes"),
        ("a: 1\n---\nb: 2\n", 2, "delete the line `---`, or make two files"),
    ],
)
def test_a_common_mistake_has_its_line_and_its_own_remedy(text: str, line: int, remedy: str) -> None:
    told = fault(text.encode())
    assert told.startswith(f"F:{line}: not valid YAML (")
    assert told.endswith(f"); {remedy}")


def test_yaml_1_1_would_count_by_eights_and_by_sixties() -> None:
    eight = "F:1: '010' would be read as 8; write it without the zero before it"
    assert lesser_faults("a: 010\n") == [eight]
    assert parse(b"a: [22:00, 1:30.5, 0, 0.5, -0.5, '010', 0x10, 10]\n", "F").value == {
        "a": ["22:00", "1:30.5", 0, 0.5, -0.5, "010", 16, 10]
    }


@pytest.mark.parametrize("end", ["", "\n", " \r\n", "\nb: 1\n"])
def test_a_number_after_a_hash_is_not_lost(end: str) -> None:
    """Two roses, #1 and #2, were one."""
    assert lesser_faults(f"a: water rose #12{end}") == [
        "F:1: #12 is a comment, and no part of 'water rose'; write the number in words, or `# 12` if it is one"
    ]


@pytest.mark.parametrize(
    "text",
    ["Rob  # the blue one", "Rob #blue", "Rob # 1", "Rob #1 of two", "Rob#1", "'Rob' #1", "3 #1", "#1", "\n  - 1 #1"],
)
def test_other_comments_are_taken_for_comments(text: str) -> None:
    assert lesser_faults(f"a: {text}\n") == []


def test_a_comma_in_a_number_is_no_key() -> None:
    comma = "F:1: a key must be text; a number has a point and no comma, as 1.5"
    assert lesser_faults("a: {x_m: 1,5, y_m: 2}\n") == [comma]


def test_not_utf_8_names_the_line() -> None:
    assert fault(b"name: Rob\nteam: caf\xe9\n") == "F:2: not UTF-8 text; save the file as UTF-8"


def test_utf_16_and_control_characters() -> None:
    assert "F:1" in fault("name: Rob\n".encode("utf-16"))
    assert fault(b"name: Rob\nteam: a\x07b\n").startswith("F:2: YAML does not allow this character")


@pytest.mark.parametrize(("escape", "shown"), [(r"\0", r"a\x00"), (r"\ud800", r"a\ud800")])
def test_an_escape_makes_no_text_that_no_file_can_have(escape: str, shown: str) -> None:
    """A folder, a port or a program of such a name was a traceback."""
    assert lesser_faults(f'a: 1\nb: "a{escape}"\n') == [
        f"F:2: '{shown}' has a character that no text can have; delete it"
    ]


def test_a_byte_order_mark_is_no_fault() -> None:
    assert parse(b"\xef\xbb\xbfname: Rob\n", "F").value == {"name": "Rob"}


@pytest.mark.parametrize("data", [b"", b"\n\n", b"# only a comment\n", b"---\n", b"~\n"])
def test_an_empty_file_holds_nothing(data: bytes, tmp_path: Path) -> None:
    assert parse(data, "F").value is None
    path = tmp_path / "empty.yaml"
    path.write_bytes(data)
    assert load_settings(path, {"name": "Rob"}).name == "Rob"


def test_a_huge_file_is_refused_by_its_size(tmp_path: Path) -> None:
    path = tmp_path / "huge.yaml"
    with path.open("wb") as file:
        file.truncate(40 * MAX_FILE_BYTES)  # sparse
    with pytest.raises(ConfigError, match="larger than 1 MiB"):
        read_bytes(path)
    path.write_bytes(b"#" * MAX_FILE_BYTES)
    assert len(read_bytes(path)) == MAX_FILE_BYTES


def test_files_that_cannot_be_opened(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="no such file"):
        read_bytes(tmp_path / "none.yaml")
    with pytest.raises(ConfigError, match="this is a directory"):
        read_bytes(tmp_path)
    with pytest.raises(ConfigError, match="not a file name"):
        read_bytes(Path("a\0b"))


def test_a_pipe_is_refused_and_not_waited_for(tmp_path: Path) -> None:
    path = tmp_path / "pipe"
    os.mkfifo(path)
    with pytest.raises(ConfigError, match=r"pipe: this is a pipe .*; name a regular file"):
        load_settings(path)


def test_a_bomb_of_aliases_is_defused() -> None:
    """The "billion laughs": nine levels of nine aliases each would be 387 million values."""
    levels = ["a0: &a0 [x, x, x, x, x, x, x, x, x]"]
    levels += [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]" for n in range(1, 9)]
    began_s = time.process_time()
    assert f"more than {MAX_VALUES} values" in fault("\n".join(levels).encode())
    assert time.process_time() - began_s < 10.0


def test_honest_aliases_are_written_out() -> None:
    assert parse(b"a: &x [1, 2]\nb: *x\n", "F").value == {"a": [1, 2], "b": [1, 2]}


def test_an_alias_of_itself() -> None:
    assert lesser_faults("a: &x [1, *x]\n") == ["F:1: an alias that contains itself; write the value out"]


@pytest.mark.parametrize("opening", ["[", "{a: ", "- "])
def test_deep_nesting_ends_before_the_stack(opening: str) -> None:
    assert f"nested deeper than {MAX_DEPTH} levels" in fault((opening * 5000).encode())


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("a: !!python/object/apply:os.system ['true']\n", "is not supported"),
        ("a: !secret x\n", "is not supported"),
        ("a: &x {b: 1}\nc: {<<: *x}\n", "merge keys (<<) are not supported"),
        ("a: 1\na: 2\n", "F:2: the key 'a' is given twice, first in line 1; keep one"),
        ("1: a\n", "a key must be text"),
        ("? [a]\n: b\n", "a key must be text"),
        ("a: 2001-99-99\n", "cannot be read; put it in quotes"),
        ("a: !!int x\n", "cannot be read; put it in quotes"),
        ("a: !!binary '/'\n", "F:1"),
    ],
)
def test_lesser_faults_keep_their_place(text: str, part: str) -> None:
    (line,) = lesser_faults(text)
    assert part in line


@given(st.binary(max_size=200))
def test_any_bytes_give_a_document_or_a_config_error(data: bytes) -> None:
    assert all(line.startswith("F:") for line in all_faults(data))


@given(st.text(alphabet="ab:-[]{}&*!?|>'\"#%@,\n\t 01.~<", max_size=60))
def test_any_punctuation_gives_a_document_or_a_config_error(text: str) -> None:
    assert all(line.startswith("F:") for line in all_faults(text.encode()))
