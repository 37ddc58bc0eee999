"""What is left of a source without its docstrings."""

from __future__ import annotations

import statistics
from pathlib import Path
from typing import Any

from release.docstrings import without_docstrings

SOURCE = '''"""Of the module,
in two lines."""

class Empty:
    "Of a class that has nothing else."

def shout(word="Ähm"): """Of a function."""; return word + """!"""

async def wait():
    # a remark
    r"""Of a coroutine.

    It waits."""
    text = """No docstring."""
    return text
'''
LEFT = '''...

class Empty:
    ...

def shout(word="Ähm"): ...; return word + """!"""

async def wait():
    # a remark
    ...
    text = """No docstring."""
    return text
'''


def test_docstrings_alone_are_left_out() -> None:
    assert without_docstrings(SOURCE) == LEFT
    assert without_docstrings(LEFT) == LEFT


def test_what_only_a_newer_python_can_read_stays() -> None:
    newer = '"""A module for a later Python."""\ntype = like this\n'
    assert without_docstrings(newer) == newer


def test_a_module_computes_as_before() -> None:
    source = Path(statistics.__file__).read_text(encoding="utf-8")
    module: dict[str, Any] = {"__name__": "bare"}
    exec(compile(without_docstrings(source), "bare", "exec", dont_inherit=True), module)
    assert module["median"].__doc__ is None
    assert module["median"]([3, 1, 2, 8]) == statistics.median([3, 1, 2, 8]) == 2.5
