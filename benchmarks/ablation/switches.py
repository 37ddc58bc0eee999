"""Ways to take a part out of the ear from outside, for as long as a `with` block lasts, and put it back.

A target is written "package.module:NAME" or "package.module:Class.attribute". Where it is not there any more,
LookupError is raised: the mechanism is gone, and so should be its entry.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from functools import wraps
from typing import Any

Switch = Callable[[], AbstractContextManager[Any]]
PACKAGE = "hvcpd"


def owner_of(target: str) -> tuple[Any, str]:
    """What holds a target, and by which name. Raises LookupError if it is not there."""
    module_name, _, path = target.partition(":")
    try:
        owner: Any = importlib.import_module(module_name)
        *parents, name = path.split(".")
        for parent in parents:
            owner = getattr(owner, parent)
        getattr(owner, name)
    except (ImportError, AttributeError):
        raise LookupError(target) from None
    return owner, name


def instead(target: str, value: Any) -> Switch:
    """With another value, function or method. Modules that have imported the name get it, too."""

    @contextmanager
    def switched() -> Iterator[None]:
        owner, name = owner_of(target)
        before = vars(owner)[name]
        holders = [owner]
        if ":" in target and "." not in target.partition(":")[2]:
            loaded = [module for key, module in sys.modules.items() if key.partition(".")[0] == PACKAGE]
            holders += [m for m in loaded if m is not owner and vars(m).get(name, ...) is before]
        for holder in holders:
            setattr(holder, name, value)
        try:
            yield
        finally:
            for holder in holders:
                setattr(holder, name, before)

    return switched


def answering(target: str, answer: Any) -> Switch:
    """A function or method that always gives this answer."""
    return instead(target, lambda *_arguments, **_named: answer)


def defaults(target: str, **values: Any) -> Switch:
    """A dataclass of settings with other defaults."""

    @contextmanager
    def switched() -> Iterator[None]:
        owner, name = owner_of(target)
        kind = getattr(owner, name)
        missing = [value for value in values if value not in kind.__dataclass_fields__]
        if missing:
            raise LookupError(f"{target}.{missing[0]}")
        original = kind.__init__

        @wraps(original)
        def made(self: Any, *arguments: Any, **named: Any) -> None:
            given = list(kind.__dataclass_fields__)[: len(arguments)]
            original(self, *arguments, **({k: v for k, v in values.items() if k not in given} | named))

        kind.__init__ = made
        try:
            yield
        finally:
            kind.__init__ = original

    return switched


def together(*switches: Switch) -> Switch:
    """All of them at once."""

    @contextmanager
    def switched() -> Iterator[None]:
        with ExitStack() as stack:
            for switch in switches:
                stack.enter_context(switch())
            yield

    return switched
