"""Takes docstrings out of Python source: half of NumPy's is documentation, which each process keeps in memory."""

from __future__ import annotations

import ast

_DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)


def without_docstrings(source: str) -> str:
    """The source with `...` for each docstring; one that only a newer Python can read stays as it is."""
    try:
        tree = ast.parse(source)
    except SyntaxError:
        return source
    lines = source.encode().splitlines(keepends=True)  # columns of the syntax tree are of UTF-8
    found = [node.body[0] for node in ast.walk(tree) if isinstance(node, _DOCUMENTED) and _has_one(node)]
    for docstring in sorted(found, key=lambda statement: -statement.lineno):
        first, last = docstring.lineno - 1, (docstring.end_lineno or docstring.lineno) - 1
        before, after = lines[first][: docstring.col_offset], lines[last][docstring.end_col_offset :]
        lines[first : last + 1] = [before + b"..." + after]
    return b"".join(lines).decode()


def _has_one(node: ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef) -> bool:
    return ast.get_docstring(node, clean=False) is not None
