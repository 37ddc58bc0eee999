"""Messages of every kind, with whatever values."""

from __future__ import annotations

import dataclasses
from typing import Any, get_args, get_origin

from hypothesis import strategies as st

from hvcpd.ros.convert import field_types
from hvcpd.ros.messages import COVARIANCE_SIZE, Byte, Covariance, Int32, Message, Uint32

MESSAGES: tuple[type[Message], ...] = get_args(Message)
_numbers = st.floats(allow_nan=False)
_texts = st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0"), max_size=12)


def _values(hint: Any) -> st.SearchStrategy[Any]:
    if hint == Covariance:
        return st.tuples(*[_numbers] * COVARIANCE_SIZE)
    if hint in (Int32, Uint32):
        return st.integers(0, 2**31 - 1) if hint == Int32 else st.integers(0, 999_999_999)
    if hint == Byte:
        return st.integers(0, 3)
    if get_origin(hint) is tuple:
        return st.lists(_values(get_args(hint)[0]), max_size=3).map(tuple)
    if dataclasses.is_dataclass(hint):
        return st.builds(hint, **{name: _values(each) for name, each in field_types(hint).items()})
    return {str: _texts, bool: st.booleans(), float: _numbers}[hint]


def messages() -> st.SearchStrategy[Any]:
    """Any message of any topic."""
    return st.sampled_from(MESSAGES).flatmap(_values)
