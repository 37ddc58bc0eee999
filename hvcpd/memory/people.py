"""Files of enrolled people, one for each, which may come from anywhere.

They hold energies, not recordings: these have a tenth of the size, and they cannot be played back as speech.
"""

from __future__ import annotations

import io
import os
import stat
import zipfile
from collections.abc import Iterable, Mapping
from itertools import chain
from pathlib import Path

import numpy as np

from hvcpd.config.files import make_folder, write_whole
from hvcpd.config.names import MAX_NAME_LENGTH, MAX_WORD_LENGTH, valid_robot_name
from hvcpd.errors import StoreError, writing
from hvcpd.memory import PEOPLE_FOLDER
from hvcpd.people.bands import N_BANDS as NET_BANDS
from hvcpd.people.bands import LogBands
from hvcpd.people.enrolled import (
    MAX_SENTENCES,
    MAX_TAKES,
    Person,
    SpokenSentence,
    Takes,
)
from hvcpd.recognition.frontend import HOP_SAMPLES, N_BANDS, Energies, mel_filterbank
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.likeness import name_fault

FORMAT = 2
"""Version of the file format; raised with every change of it, or of the front ends' bands."""
READABLE = (1, FORMAT)
"""Version 1 has no sentences."""
SUFFIX = ".npz"
MAX_FILE_BYTES = 32_000_000
"""The phrasebook's 100 words in MAX_TAKES takes have 6 MB unpacked; a file that is larger is none of ours."""
MAX_WORDS = 1000
MAX_SENTENCE_WORDS = 40
_SENTENCE, _SAID = "sentence ", "said"
"""Names of arrays in a file: of each sentence, and of the words of all; no word has a space."""
MIN_FRAMES, MAX_FRAMES = 5, 250
"""Range of a take's length; 2.5 s: nobody takes as long for one word."""
MAX_SENTENCE_FRAMES = 1600
"""16 s, longer than any sentence."""
MAX_LOG = 40.0
"""Of an energy's natural logarithm, either way: 174 dB."""


def person_path(state_dir: Path, name: str) -> Path:
    """The path of a person's file."""
    return state_dir / PEOPLE_FOLDER / f"{name.lower()}{SUFFIX}"


_BY_OWNER = "run this as the daemon's user"


def enrolled_people(state_dir: Path) -> tuple[dict[str, Person], tuple[str, ...]]:
    """All enrolled people, by name in lower case, and the faults of unusable files, or of their folder."""
    folder = state_dir / PEOPLE_FOLDER
    people: dict[str, Person] = {}
    faults = []
    try:
        files = sorted(path for path in folder.iterdir() if path.suffix == SUFFIX and not path.name.startswith("."))
    except FileNotFoundError:
        files = []
        if folder.is_symlink():
            faults.append(f"{folder}: a link to nothing, so nobody's voice is known; mount its disk, or delete it")
    except NotADirectoryError:
        files = []
        if state_dir.is_dir():
            faults.append(f"{folder}: no folder, so nobody's voice is known; move it away")
    except OSError as error:
        return {}, (f"{folder}: cannot be read ({error.strerror}), so nobody's voice is known; {_BY_OWNER}",)
    for path in files:
        try:
            person = read_person(path)
        except StoreError as error:
            faults.append(str(error))
            continue
        if path == (own := person_path(state_dir, person.name)):
            people[person.name.lower()] = person
        else:
            faults.append(f"{path}: this is {person.name}'s voice, of {own.name}; give it to hvcpctl enrol --import")
    return people, tuple(faults)


def tellable_people(
    state_dir: Path, robots: Iterable[str], lexicon: Lexicon, allow_same: bool = False
) -> tuple[dict[str, Person], tuple[str, ...]]:
    """As `enrolled_people`, without those whose names sound like a word of the phrasebook or, unless `allow_same`, like
    another name: with such a name no robot would start."""
    found, faults = enrolled_people(state_dir)
    people: dict[str, Person] = {}
    said = {name.lower(): set(lexicon.sounds(name)) for name in robots}
    for key, person in found.items():
        sounds, fault = set(lexicon.sounds(person.name)), name_fault(person.name, lexicon)
        alike = (other for other in said if other != key and said[other] & sounds)
        if fault is None and not allow_same and (rival := next(alike, None)) is not None:
            fault = f"the name {person.name!r} sounds the same as {rival!r}"
        if fault is None:
            people[key], said[key] = person, sounds
        else:
            remedy = f"so this voice is not known; hvcpctl enrol {person.name} --remove"
            faults = (*faults, f"{person_path(state_dir, key)}: {fault}, {remedy}")
    return people, faults


def write_person(path: Path, person: Person) -> None:
    """Write the file whole, for its owner and group alone; where a link points, if it is one. Raises StoreError."""
    # The energies' digits beyond float16's of the logarithm are noise of the microphone.
    logs = {
        f"{word}/{k}": np.log(t).astype(np.float16) for word, takes in person.takes.items() for k, t in enumerate(takes)
    }
    heard = {f"{_SENTENCE}{k}": each.logs.astype(np.float16) for k, each in enumerate(person.sentences)}
    said = np.array([" ".join(each.words) for each in person.sentences], dtype=np.str_)
    head = np.array([FORMAT, N_BANDS, HOP_SAMPLES], np.int64)
    named = {"name": np.array(person.name), "filters": _filters(), _SAID: said}
    data = io.BytesIO()
    np.savez_compressed(data, head=head, **named, **logs, **heard)  # type: ignore[arg-type]
    with writing(path, StoreError, otherwise=f"{_BY_OWNER}, or name another place"):
        make_folder(Path(os.path.realpath(path)).parent)
        write_whole(path, data.getvalue(), 0o640)


def is_enrolled(path: Path) -> bool:
    """Whether there is such a file. Raises StoreError where this user may not look."""
    try:
        return path.is_file()
    except OSError as error:
        raise StoreError(f"{path}: {error.strerror}; {_BY_OWNER}, or with sudo") from error


def remove_person(path: Path) -> bool:
    """Forget a person; return whether there was one. Raises StoreError."""
    try:
        path.unlink()
    except FileNotFoundError:
        return False
    except OSError as error:
        raise StoreError(f"{path} cannot be deleted ({error.strerror}); {_BY_OWNER}") from error
    return True


def read_person(path: Path) -> Person:
    """Read the person from an untrusted file. Raises StoreError that names the file and the fault."""
    try:
        state = path.stat()
        if not stat.S_ISREG(state.st_mode):  # to open a pipe would wait for its writer
            raise _WrongError("it is a folder, a pipe or a device")
        if state.st_size > MAX_FILE_BYTES:
            raise _WrongError(f"it is larger than {MAX_FILE_BYTES // 1_000_000} MB")
        with zipfile.ZipFile(path) as archive:
            if sum(entry.file_size for entry in archive.infolist()) > MAX_FILE_BYTES:
                raise _WrongError(f"unpacked it is larger than {MAX_FILE_BYTES // 1_000_000} MB")
        with np.load(path, allow_pickle=False) as file:
            return _person(file)
    except _WrongError as wrong:
        raise StoreError(f"{path}: this is not an enrolment by hvcpd: {wrong}; enrol the person again") from None
    except OSError as error:
        raise StoreError(f"{path} cannot be read: {error.strerror or error}; name another file") from None
    except Exception as error:  # zipfile and numpy raise all kinds for files that are damaged, or were made to do harm
        raise StoreError(f"{path}: this is not an enrolment by hvcpd ({error}); enrol the person again") from None


def content(person: Person) -> dict[str, list[tuple[str, bytes]]]:
    """The sentences and the takes, to be counted and compared: of each its words, and a print of its energies."""
    takes = [_print(word, np.log(take)) for word in sorted(person.takes) for take in person.takes[word]]
    return {"sentences": [_print(" ".join(each.words), each.logs) for each in person.sentences], "takes": takes}


def unknown(person: Person, takes: Takes, sentences: Iterable[SpokenSentence]) -> tuple[Takes, list[SpokenSentence]]:
    """Those of the takes and sentences that this person has not, each once: they may be of the same recordings."""
    seen = set(chain(*content(person).values()))

    def is_new(text: str, logs: LogBands) -> bool:
        known, mark = len(seen), _print(text, logs)
        seen.add(mark)
        return len(seen) > known

    news = {word: [take for take in of_word if is_new(word, np.log(take))] for word, of_word in takes.items()}
    said = [each for each in sentences if is_new(" ".join(each.words), each.logs)]
    return {word: of_word for word, of_word in news.items() if of_word}, said


def joined(person: Person, other: Person) -> Person:
    """The same with what another record of this person has more."""
    takes, sentences = unknown(person, other.takes, other.sentences)
    return person.with_takes(takes).with_sentences(sentences)


def _print(text: str, logs: LogBands) -> tuple[str, bytes]:
    """What is the same for two readings of one recording, also if one was in a file, which has float16."""
    return text, logs.astype(np.float16).tobytes()


class _WrongError(Exception):
    """The error for a faulty file."""


def _filters() -> np.ndarray:
    """The centre of each band, as a fingerprint of the front end."""
    filters = mel_filterbank()
    return np.asarray((np.arange(len(filters)) @ filters / filters.sum(axis=0)).astype(np.float32))


def _person(file: Mapping[str, np.ndarray]) -> Person:
    head, filters, name = file["head"], file["filters"], file["name"]
    is_ours = head.shape == (3,) and head.dtype.kind == "i" and tuple(head[1:]) == (N_BANDS, HOP_SAMPLES)
    _require(is_ours and head[0] in READABLE, "it was made by another version")
    is_like = filters.shape == (N_BANDS,) and filters.dtype.kind == "f" and np.allclose(filters, _filters())
    _require(is_like, "it was made with another front end")
    is_name = name.shape == () and name.dtype.kind == "U" and name.dtype.itemsize <= 4 * MAX_NAME_LENGTH
    _require(is_name, "it names nobody")
    fault = valid_robot_name(str(name))
    _require(fault is None, fault or "")
    keys = [key for key in file if key not in ("head", "name", "filters", _SAID) and not key.startswith(_SENTENCE)]
    _require(len(keys) <= MAX_WORDS * MAX_TAKES, "it has too many takes")
    takes: dict[str, list[Energies]] = {}
    for key in sorted(keys):
        word, _, number = key.partition("/")
        _require(_is_word(word), "a take is of no word")
        _require(number.isdecimal() and int(number) < MAX_TAKES, f"a take of '{word}' has no number")
        logs = _logs(file[key], N_BANDS, MAX_FRAMES, f"a take of '{word}'")
        takes.setdefault(word, []).append(np.exp(logs))
    return Person(str(name), takes, _sentences(file))


def _sentences(file: Mapping[str, np.ndarray]) -> tuple[SpokenSentence, ...]:
    if _SAID not in file:
        return ()
    said = file[_SAID]
    is_text = said.dtype.kind == "U" and said.ndim == 1 and len(said) <= MAX_SENTENCES
    _require(is_text, "its sentences have no words")
    found = []
    for number, text in enumerate(map(str, said)):
        words = tuple(text.split(" "))
        _require(len(words) <= MAX_SENTENCE_WORDS and all(map(_is_word, words)), "a sentence has no words")
        logs = _logs(file[f"{_SENTENCE}{number}"], NET_BANDS, MAX_SENTENCE_FRAMES, "a sentence")
        found.append(SpokenSentence(words, logs))
    return tuple(found)


def _require(holds: bool, fault: str) -> None:
    if not holds:
        raise _WrongError(fault)


def _is_word(word: str) -> bool:
    return word.isascii() and word.isalnum() and word == word.lower() and len(word) <= MAX_WORD_LENGTH


def _logs(logs: np.ndarray, n_bands: int, most_frames: int, what: str) -> LogBands:
    """The logarithms of energies, shape (frames, n_bands), as they are in a file."""
    fits = logs.ndim == 2 and logs.shape[1] == n_bands and MIN_FRAMES <= len(logs) <= most_frames
    _require(fits and logs.dtype == np.float16, f"{what} has the wrong shape")
    _require(bool(np.isfinite(logs).all()) and float(np.abs(logs).max()) <= MAX_LOG, f"{what} holds no sound")
    return logs.astype(np.float32)
