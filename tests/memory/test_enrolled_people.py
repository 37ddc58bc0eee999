"""The file of a person's words: what is written is read again, and nothing else."""

from __future__ import annotations

import io
import os
import pickle
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hvcpd.errors import StoreError
from hvcpd.memory.people import (
    content,
    enrolled_people,
    person_path,
    read_person,
    remove_person,
    tellable_people,
    write_person,
)
from hvcpd.people.bands import N_BANDS as NET_BANDS
from hvcpd.people.enrolled import MAX_SENTENCES, Person, SpokenSentence
from hvcpd.recognition.frontend import N_BANDS
from hvcpd.synthesis.lexicon import Lexicon
from tests.full_disk import no_new_bytes


def take(seed: int, frames: int = 40) -> np.ndarray:
    return np.exp(np.random.default_rng(seed).normal(-6.0, 2.0, (frames, N_BANDS))).astype(np.float32)


ANNA = Person("Anna", {"stop": [take(1), take(2)], "hi": [take(3, 30)]})


def test_what_is_written_is_read_again(tmp_path: Path) -> None:
    path = person_path(tmp_path, "Anna")
    write_person(path, ANNA)
    again = read_person(path)
    assert again.name == "Anna"
    assert again.takes.keys() == {"stop", "hi"}
    for word, takes in ANNA.takes.items():
        assert len(again.takes[word]) == len(takes)
        for one, other in zip(takes, again.takes[word], strict=True):
            np.testing.assert_allclose(np.log(one), np.log(other), atol=0.01)
    assert path.stat().st_mode & 0o007 == 0


def test_a_device_or_a_pipe_is_not_replaced_and_a_link_leads_to_the_file(tmp_path: Path) -> None:
    """`enrol --export /dev/null` as root made a file of it."""
    pipe, link, file = tmp_path / "pipe", tmp_path / "link.npz", tmp_path / "file.npz"
    os.mkfifo(pipe)
    with pytest.raises(StoreError, match="this is a device or a pipe; name a file"):
        write_person(pipe, ANNA)
    assert pipe.is_fifo()
    link.symlink_to(file)
    write_person(link, ANNA)
    assert link.is_symlink()
    assert read_person(file).takes.keys() == ANNA.takes.keys()


def test_nothing_is_left_where_the_disk_is_full(tmp_path: Path) -> None:
    with no_new_bytes(), pytest.raises(StoreError, match="make room there"):
        write_person(person_path(tmp_path, "Anna"), ANNA)
    assert not list(tmp_path.rglob("*.part"))


@pytest.mark.parametrize("make", [os.mkfifo, os.mkdir])
def test_what_is_no_file_is_not_opened(make: Callable[[Path], None], tmp_path: Path) -> None:
    """The daemon waited for whoever would write into a pipe, and did not even end when it was told to."""
    path = person_path(tmp_path, "Anna")
    path.parent.mkdir()
    make(path)
    people, (fault,) = enrolled_people(tmp_path)
    assert not people
    assert "it is a folder, a pipe or a device" in fault


@pytest.mark.parametrize(
    ("make", "what"),
    [
        (Path.touch, "no folder"),
        (os.mkfifo, "no folder"),
        (lambda path: path.symlink_to("/no/such"), "a link to nothing"),
    ],
)
def test_what_is_in_the_place_of_the_folder_is_told(make: Callable[[Path], None], what: str, tmp_path: Path) -> None:
    """Nobody was enrolled then, without a word."""
    make(tmp_path / "people")
    people, (fault,) = enrolled_people(tmp_path)
    assert not people
    assert fault.startswith(f"{tmp_path}/people: {what}, so nobody's voice is known; ")


def test_a_folder_that_is_not_there_is_no_fault(tmp_path: Path) -> None:
    assert enrolled_people(tmp_path) == ({}, ())
    assert enrolled_people(tmp_path / "state") == ({}, ())


def test_sentences_are_read_again_and_the_newest_are_kept(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    said = [
        SpokenSentence(("hi", f"r{k}"), rng.normal(0, 2, (30 + k, NET_BANDS)).astype(np.float32)) for k in range(25)
    ]
    path = person_path(tmp_path, "Anna")
    write_person(path, ANNA.with_sentences(said))
    again = read_person(path)
    assert [each.words for each in again.sentences] == [each.words for each in said[-MAX_SENTENCES:]]
    for one, other in zip(said[-MAX_SENTENCES:], again.sentences, strict=True):
        np.testing.assert_allclose(one.logs, other.logs, atol=0.01)
    assert again.takes.keys() == ANNA.takes.keys()
    assert content(again) != content(ANNA)
    assert content(again) == content(read_person(path))


@pytest.mark.parametrize(
    ("words", "logs"),
    [
        (("hi",), np.zeros((30, NET_BANDS + 1), np.float32)),
        (("hi",), np.zeros((1, NET_BANDS), np.float32)),
        (("hi",), np.full((30, NET_BANDS), np.inf, np.float32)),
        (("../x",), np.zeros((30, NET_BANDS), np.float32)),
        (("hi",) * 50, np.zeros((30, NET_BANDS), np.float32)),
    ],
)
def test_sentences_that_are_none_are_refused(words: tuple[str, ...], logs: np.ndarray, tmp_path: Path) -> None:
    path = person_path(tmp_path, "Anna")
    write_person(path, Person("Anna", sentences=(SpokenSentence(words, logs),)))
    with pytest.raises(StoreError, match="not an enrolment by hvcpd: a sentence"):
        read_person(path)


def test_people_are_known_by_their_files_and_forgotten_with_them(tmp_path: Path) -> None:
    write_person(person_path(tmp_path, "Anna"), ANNA)
    write_person(person_path(tmp_path, "Ben"), Person("Ben", {"stop": [take(4)]}))
    person_path(tmp_path, "Eve").write_bytes(b"nonsense")
    people, faults = enrolled_people(tmp_path)
    assert sorted(people) == ["anna", "ben"]
    assert len(faults) == 1
    assert "eve.npz" in faults[0]
    assert remove_person(person_path(tmp_path, "Ben"))
    assert not remove_person(person_path(tmp_path, "Ben"))
    assert sorted(enrolled_people(tmp_path)[0]) == ["anna"]


def arrays_of(path: Path) -> dict[str, np.ndarray]:
    with np.load(path) as file:
        return {key: file[key] for key in file}


@pytest.mark.parametrize(
    ("key", "value", "why"),
    [
        ("head", np.array([99, N_BANDS, 160]), "another version"),
        ("filters", np.ones(N_BANDS, np.float32), "another front end"),
        ("name", np.array("../../etc"), "not a letter"),
        ("name", np.array("x" * 4000), "nobody"),
        ("stop/0", np.zeros((40, 3), np.float16), "wrong shape"),
        ("stop/0", np.zeros((4000, N_BANDS), np.float16), "wrong shape"),
        ("stop/0", np.zeros((40, N_BANDS), np.float64), "wrong shape"),
        ("stop/0", np.full((40, N_BANDS), np.nan, np.float16), "no sound"),
        ("stop/77", np.zeros((40, N_BANDS), np.float16), "no number"),
        ("../stop/0", np.zeros((40, N_BANDS), np.float16), "no word"),
    ],
)
def test_a_file_that_is_not_ours_is_refused(tmp_path: Path, key: str, value: np.ndarray, why: str) -> None:
    path = tmp_path / "anna.npz"
    write_person(path, ANNA)
    np.savez_compressed(path, **{**arrays_of(path), key: value})  # type: ignore[arg-type]
    with pytest.raises(StoreError, match=why) as caught:
        read_person(path)
    assert "anna.npz" in str(caught.value)


def test_a_pickle_in_the_file_is_not_run(tmp_path: Path) -> None:
    ran = tmp_path / "ran"

    class Trap:
        def __reduce__(self) -> tuple[object, tuple[Path]]:
            return Path.touch, (ran,)

    path = tmp_path / "anna.npz"
    buffer = io.BytesIO()
    np.lib.format.write_array(buffer, np.array([1, 2], object), allow_pickle=True)
    header = buffer.getvalue()[:128]
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("head.npy", header + pickle.dumps(Trap()))
    with pytest.raises(StoreError):
        read_person(path)
    assert not ran.exists()


def header(shape: tuple[int, ...], kind: str = "<f2") -> bytes:
    """Of an array, whose data is missing."""
    buffer = io.BytesIO()
    np.lib.format.write_array_header_1_0(buffer, {"descr": kind, "fortran_order": False, "shape": shape})
    return buffer.getvalue()


@pytest.mark.parametrize(
    ("entry", "data"),
    [
        ("head.npy", b"no array"),
        ("said.npy", b"no array"),
        ("stop/0.npy", header((10**15,))),
        ("name.npy", header((), "<U1") + b"\xff" * 4),
        ("head.npy", b"\x93NUMPY\x01\x00\x28\x23" + b"(" * 9000),
    ],
)
def test_arrays_that_are_none_are_clear_errors(entry: str, data: bytes, tmp_path: Path) -> None:
    """The daemon did not start, and no command worked any more."""
    path = person_path(tmp_path, "Anna")
    write_person(path, ANNA)
    with zipfile.ZipFile(path) as archive:
        entries = {name: archive.read(name) for name in archive.namelist()} | {entry: data}
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in entries.items():
            archive.writestr(name, content)
    people, (fault,) = enrolled_people(tmp_path)
    assert not people
    assert fault.startswith(f"{path}: this is not an enrolment by hvcpd")


def test_a_file_under_another_name_does_not_count(tmp_path: Path) -> None:
    """Anna was still known when her own file was removed."""
    copy = person_path(tmp_path, "Copy")
    write_person(copy, ANNA)
    people, (fault,) = enrolled_people(tmp_path)
    assert not people
    assert fault == f"{copy}: this is Anna's voice, of anna.npz; give it to hvcpctl enrol --import"


def test_whose_name_is_a_word_or_sounds_like_another_is_not_known(tmp_path: Path) -> None:
    """With such a file, say an imported one, no robot started, nor did any command work."""
    for name in ("Anna", "Ana", "friend", "Robb"):
        write_person(person_path(tmp_path, name), Person(name, {"stop": [take(4)]}))
    people, faults = tellable_people(tmp_path, ("Rob", "Anna"), Lexicon.load())
    assert people.keys() == {"anna"}
    assert [fault.split("; ")[-1] for fault in faults] == [
        f"hvcpctl enrol {name} --remove" for name in ("Ana", "friend", "Robb")
    ]
    assert "'Robb' sounds the same as 'rob', so this voice is not known" in faults[-1]
    assert tellable_people(tmp_path, ("Rob",), Lexicon.load(), allow_same=True)[0].keys() == {"ana", "anna", "robb"}


def test_a_small_file_that_unpacks_into_a_huge_one_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "anna.npz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("head.npy", b"\0" * 40_000_000)
    assert path.stat().st_size < 100_000
    with pytest.raises(StoreError, match="unpacked"):
        read_person(path)


@given(st.binary(max_size=300), st.integers(0, 400))
def test_damage_is_a_clear_error(tmp_path_factory: pytest.TempPathFactory, junk: bytes, at: int) -> None:
    path = person_path(tmp_path_factory.mktemp("damage"), "Anna")
    write_person(path, Person("Anna", {"hi": [take(3, 10)]}))
    whole = path.read_bytes()
    path.write_bytes(whole[:at] + junk + whole[at + len(junk) :])
    people, faults = enrolled_people(path.parent.parent)
    assert list(people) == ["anna"] or "anna.npz" in faults[0]
