"""Benchmarks name what there is: they are run seldom, and some need libraries that are not here."""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path

import pytest

from benchmarks.confidence import Watched
from tests.recognition.signals import graph, in_noise, sentence, templates

ROOT = Path(__file__).parents[2]
ROOMS = ("hvcpd", "hil_fakes", "benchmarks")
FILES = sorted((ROOT / "benchmarks").rglob("*.py"))


def path_of(module: str) -> Path:
    path = ROOT / module.replace(".", "/")
    return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")


@cache
def names_of(path: Path) -> frozenset[str]:
    """All names that a module binds anywhere, imported ones and submodules among them."""
    found = {each.stem for each in path.parent.iterdir()} if path.name == "__init__.py" else set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            found.add(node.name)
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            found.add(node.id)
        elif isinstance(node, ast.Import | ast.ImportFrom):
            found |= {alias.asname or alias.name for alias in node.names}
    return frozenset(found)


@pytest.mark.parametrize("file", FILES, ids=lambda file: str(file.relative_to(ROOT)))
def test_a_benchmark_imports_only_what_there_is(file: Path) -> None:
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] in (
            "hvcpd",
            "hil_fakes",
            "benchmarks",
        ):
            path = path_of(node.module or "")
            assert path.is_file(), node.module
            missing = {alias.name for alias in node.names} - names_of(path)
            assert not missing, f"{node.module} has no {missing}"


def test_the_sentences_that_are_judged_are_kept_for_the_fit() -> None:
    recogniser = Watched(graph(), templates())
    recogniser.push(in_noise(sentence("hi rob")))
    assert ("hi", "rob") in [words for _, words in recogniser.judged]
