"""The API reference of the packages that other projects can use, from signatures and docstrings; a part of the site.

It is made when the site is built and kept nowhere, so it always fits the code. Nothing is imported: the source is read.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGES = {
    "hil_fakes": "Fakes of motors, sound and rooms.",
    "hvcpd/language": "The phrasebook: sentences and their meaning.",
    "hvcpd/recognition": "From sound to sentences.",
    "hvcpd/synthesis": "From words to sound.",
}
"""Folders, and what is in them."""
EXAMPLES = "[Examples](python.md) show how to use it; a test runs them."
MAX_COLUMNS = 100
"""A signature that is longer has a line for each argument."""

Definition = ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef


def page_name(package: str) -> str:
    """The page's file in docs/reference, as `mkdocs.yml` has it."""
    return f"reference/api-{package.rpartition('/')[2]}.md"


def page(package: str) -> str:
    """The page of a package, in Markdown: its public modules, classes, methods and functions."""
    parts = [f"# `{package.replace('/', '.')}`\n\n{PACKAGES[package]} {EXAMPLES}\n\n"]
    for path in sorted((ROOT / package).rglob("*.py")):
        if not path.name.startswith("_"):
            tree = ast.parse(path.read_text(encoding="utf-8"))
            name = path.relative_to(ROOT).with_suffix("").as_posix().replace("/", ".")
            parts += [f"## {name}\n\n{_text(tree)}", *_definitions(tree)]
    return "".join(parts)


def _definitions(tree: ast.Module) -> Iterator[str]:
    for node in _public(tree.body):
        yield f"### {node.name}\n\n```python\n{_signature(node)}\n```\n\n{_text(node)}"
        if isinstance(node, ast.ClassDef):
            for method in _public(node.body):
                yield f"#### {node.name}.{method.name}\n\n```python\n{_signature(method)}\n```\n\n{_text(method)}"


def _public(body: list[ast.stmt]) -> Iterator[Definition]:
    for node in body:
        if isinstance(node, Definition) and not node.name.startswith("_"):
            yield node


def _text(node: ast.Module | Definition) -> str:
    text = ast.get_docstring(node) or ""
    return text.replace("<", "&lt;").replace("](", "] (") + "\n\n" if text else ""


def _signature(node: Definition) -> str:
    if isinstance(node, ast.ClassDef):
        fields = [s for s in node.body if isinstance(s, ast.AnnAssign) and isinstance(s.target, ast.Name)]
        shown = [ast.unparse(field) for field in fields if not ast.unparse(field.target).startswith("_")]
        init = next((s for s in node.body if isinstance(s, ast.FunctionDef) and s.name == "__init__"), None)
        if init is not None:
            shown = _arguments(init.args)[1:]
        bases = f"({', '.join(map(ast.unparse, node.bases))})" if node.bases and not shown else ""
        return _call(f"class {node.name}{bases}", shown, "") if shown else f"class {node.name}{bases}"
    kinds = {ast.unparse(each) for each in node.decorator_list}
    result = f" -> {ast.unparse(node.returns)}" if node.returns is not None else ""
    if "property" in kinds:
        return f"{node.name}{result.replace(' -> ', ': ')}"
    arguments = [argument for argument in _arguments(node.args) if argument not in ("self", "cls")]
    start = "async def" if isinstance(node, ast.AsyncFunctionDef) else "def"
    return _call(f"{start} {node.name}", arguments, result)


def _arguments(given: ast.arguments) -> list[str]:
    """Each argument with its type and default, as it is written."""
    positional = [*given.posonlyargs, *given.args]
    defaults = [None] * (len(positional) - len(given.defaults)) + list(given.defaults)
    shown = [_argument(one, default) for one, default in zip(positional, defaults, strict=True)]
    if given.vararg is not None:
        shown.append(f"*{_argument(given.vararg, None)}")
    elif given.kwonlyargs:
        shown.append("*")
    shown += [_argument(one, default) for one, default in zip(given.kwonlyargs, given.kw_defaults, strict=True)]
    return [*shown, *([f"**{_argument(given.kwarg, None)}"] if given.kwarg is not None else [])]


def _argument(one: ast.arg, default: ast.expr | None) -> str:
    typed = ast.unparse(one)
    if default is None:
        return typed
    return f"{typed} = {ast.unparse(default)}" if one.annotation is not None else f"{typed}={ast.unparse(default)}"


def _call(head: str, arguments: list[str], result: str) -> str:
    line = f"{head}({', '.join(arguments)}){result}"
    if len(line) <= MAX_COLUMNS:
        return line
    return "\n".join([f"{head}(", *(f"    {argument}," for argument in arguments), f"){result}"])
