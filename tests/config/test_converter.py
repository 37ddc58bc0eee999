"""Plain values as dataclasses: what is read, what is refused, and that every fault is found at once."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hvcpd.config.loading import Converter, FaultError, between, checked


@dataclass(frozen=True)
class Wheel:
    radius_m: float = field(metadata=between(0.01, 0.2))
    side: Literal["left", "right"] = "left"


@dataclass(frozen=True)
class Robot:
    name: str = field(metadata=checked(lambda name: None if name.isalpha() else f"{name!r} is no name"))
    wheels: tuple[Wheel, ...] = ()
    spare: Wheel | None = None
    notes: Mapping[str, int] = field(default_factory=dict)
    folder: Path | None = None
    lamp: bool = False
    extra: Any = None


def faults(value: Any, type_: Any, converter: Converter | None = None) -> dict[tuple[str | int, ...], str]:
    with pytest.raises(FaultError) as caught:
        (converter or Converter({})).structure(value, type_)
    return {fault.path: fault.told for fault in caught.value.faults}


wheels = st.builds(Wheel, st.floats(0.01, 0.2), st.sampled_from(("left", "right")))
robots = st.builds(
    Robot,
    st.from_regex("[A-Z][a-z]{1,8}", fullmatch=True),
    st.lists(wheels, max_size=3).map(tuple),
    st.none() | wheels,
    st.dictionaries(st.text(max_size=5), st.integers()),
    st.none() | st.just(Path("/tmp/a")),
    st.booleans(),
    st.none() | st.lists(st.integers()) | st.text(),
)


def plain(value: Any) -> Any:
    """As YAML has it."""
    match value:
        case tuple():
            return [plain(each) for each in value]
        case dict():
            return {key: plain(each) for key, each in value.items()}
        case Path():
            return str(value)
        case _:
            return value


@given(robots)
def test_what_was_written_is_read_back(robot: Robot) -> None:
    assert Converter({}).structure(plain(dataclasses.asdict(robot)), Robot) == robot


def test_what_is_left_out_has_its_default() -> None:
    assert Converter({}).structure({"name": "Rob"}, Robot) == Robot("Rob")


def test_every_fault_is_found_with_the_way_to_it() -> None:
    value = {
        "name": "R2",
        "wheels": [{"radius_m": 0.03}, {"radius_m": 3, "side": "top"}, 7],
        "spare": {"side": "left"},
        "notes": {"a": 1, "b": "2"},
        "lamp": "yes",
        "lmap": True,
    }
    found = faults(value, Robot)
    assert found.keys() == {
        ("name",),
        ("wheels", 1, "radius_m"),
        ("wheels", 1, "side"),
        ("wheels", 2),
        ("spare", "radius_m"),
        ("notes", "b"),
        ("lamp",),
        ("lmap",),
    }
    assert found["name",] == "name: 'R2' is no name"
    assert found["wheels", 2].startswith("wheels: expected a group of keys (radius_m, side), found the number 7")
    assert found["spare", "radius_m"] == "the key 'radius_m' is missing; add it"
    assert found["lmap",].startswith("unknown key 'lmap'; did you mean 'lamp'")


@pytest.mark.parametrize(
    ("value", "type_"),
    [
        ("5", int),
        (5.0, int),
        (True, int),
        ("5", float),
        (True, float),
        (float("nan"), float),
        (10**400, float),
        (1, bool),
        (5, str),
        ("", Path),
        ("a\0b", Path),
        (None, int),
        ("a", tuple[int, ...]),
        ([1, "a"], tuple[int, ...]),
        ([1], tuple[int, str]),
        ([], Mapping[str, int]),
        (1, Literal["1"]),
        (True, Literal[1, 2]),
    ],
)
def test_nothing_is_converted_that_a_person_may_not_have_meant(value: Any, type_: Any) -> None:
    assert faults(value, type_)


def test_a_group_is_not_checked_where_its_value_is_at_fault() -> None:
    assert faults({"radius_m": "wide"}, Wheel)["radius_m",].startswith("radius_m: expected a number")


def test_tuples_of_several_types_and_mappings_as_json_has_them() -> None:
    read = Converter({}).structure([[1, "a"], [2, "b"]], tuple[tuple[int, str], ...])
    assert read == ((1, "a"), (2, "b"))
    assert Converter({}).structure({"a": 1.5}, dict[str, float]) == {"a": 1.5}


def test_hooks_read_types_of_ones_own_and_their_faults_have_the_way_around_them() -> None:
    def wheel(value: Any, converter: Converter) -> Wheel:
        if value == "flat":
            raise FaultError("it is flat", "tyre")
        return Wheel(converter.structure(value, float))

    converter = Converter({Wheel: wheel})
    assert converter.structure({"name": "Rob", "spare": 0.1}, Robot).spare == Wheel(0.1)
    assert faults({"name": "Rob", "wheels": ["flat"]}, Robot, converter) == {("wheels", 0, "tyre"): "tyre: it is flat"}


def test_keys_of_a_newer_version_may_be_passed_over() -> None:
    assert Converter({}, extra_keys=True).structure({"radius_m": 0.1, "tread": 3}, Wheel) == Wheel(0.1)


def test_a_type_without_a_rule_is_our_own_mistake() -> None:
    with pytest.raises(TypeError, match="no rule"):
        Converter({}).structure("a", float | str)
