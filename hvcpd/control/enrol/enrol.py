"""`hvcpctl enrol`: a person's sentences or words, from the microphone or from WAVs, and where they are kept."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from hvcpd.config.names import valid_robot_name
from hvcpd.config.settings_file import load_settings, load_with_sources
from hvcpd.control.enrol.enrol_sentences import sentences_for
from hvcpd.control.enrol.enrol_session import CheckOfSentence, record_sentences, record_takes
from hvcpd.control.enrol.recordings import check_sentence, check_take, confusable, odd_takes, other_speaker
from hvcpd.control.output import print_note, show
from hvcpd.control.simulate.team import Team, load_team
from hvcpd.daemon.devices import Devices
from hvcpd.errors import EX_FAILURE, EX_OK, AudioFileError, ConfigError, StoreError, writing
from hvcpd.hardware.soundfile import read_wav
from hvcpd.language.competition import competing_phrases
from hvcpd.memory.people import (
    content,
    enrolled_people,
    is_enrolled,
    joined,
    person_path,
    read_person,
    remove_person,
    unknown,
    write_person,
)
from hvcpd.people.enrolled import MAX_TAKES, Person, SpokenSentence
from hvcpd.recognition.frontend import Energies
from hvcpd.reporting.text import plural

_NUMBERED = re.compile(r"([a-z]+)(?:[_-]?\d+)?")
"""Names of takes of one word: stop.wav, stop_1.wav, stop-2.wav, stop3.wav."""
_SENTENCE = re.compile(r"sentence_([0-9]+)\.wav")
FIRST = ("stop", "hi", "all", "i", "am")
"""Words that are asked for first, so that an interrupted session has the most important ones."""
HOW_IT_COUNTS = "a running robot loads them with: hvcpctl reload"


@dataclass
class Report:
    """The result of an enrolment."""

    sentences: int = 0
    words: int = 0
    takes: int = 0
    known: int = 0
    """Sentences and takes that this person has already."""
    rejected: list[str] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)
    confusable: list[tuple[str, str]] = field(default_factory=list)
    other_name: str | None = None
    """Who the speaker of the sentences says to be, if that is another of the names."""


def run(options: argparse.Namespace, devices: Devices | None = None) -> int:
    """Do what the options ask for; without an action, record."""
    if options.list:
        _list(options)
    elif options.import_ is not None:
        _import(options)
    elif options.person is None:
        raise ConfigError("whose voice? hvcpctl enrol NAME, for example: hvcpctl enrol Anna")
    elif fault := valid_robot_name(options.person):
        raise ConfigError(fault)
    elif options.remove:
        _remove(options)
    elif options.export is not None:
        _export(options)
    else:
        return _enrol(options, devices or Devices())
    return EX_OK


def _state_dir(options: argparse.Namespace) -> Path:
    settings = load_settings(options.config, name_needed=False)
    folder: Path = options.state_dir or settings.state_dir
    if folder.exists() and not folder.is_dir():
        raise ConfigError(f"{folder}: this is no folder; name the one where takes are kept")
    return folder


def _list(options: argparse.Namespace) -> None:
    people, faults = enrolled_people(_state_dir(options))
    if faults and not people:
        raise StoreError("\n".join(faults))
    for fault in faults:
        print_note(fault)
    rows: list[dict[str, Any]] = [
        {"name": p.name, "sentences": len(p.sentences), "words": len(p.takes), "takes": sum(map(len, p.takes.values()))}
        for p in people.values()
    ]
    lines = []
    for row in rows:
        counts = ", ".join(plural(row[f"{one}s"], one) for one in ("sentence", "word", "take"))
        lines.append(f"{row['name']}: {counts}")
    show(options.json, rows, *(lines or ["nobody is enrolled; enrol somebody with: hvcpctl enrol NAME"]))


def _known(options: argparse.Namespace) -> Path:
    path = person_path(_state_dir(options), options.person)
    if not is_enrolled(path):
        raise StoreError(f"{options.person} is not enrolled ({path}); hvcpctl enrol --list lists who is")
    return path


def _remove(options: argparse.Namespace) -> None:
    remove_person(_known(options))
    sys.stdout.write(f"{options.person} is forgotten; a running robot forgets the voice with: hvcpctl reload\n")


def _export(options: argparse.Namespace) -> None:
    person = read_person(_known(options))
    with writing(options.export, StoreError):
        options.export.parent.stat()  # only the robot's own folder is made
    write_person(options.export, person)
    sys.stdout.write(f"{options.person} is written to {options.export}\n")


def _import(options: argparse.Namespace) -> None:
    person = read_person(options.import_)
    if options.person is not None and options.person.lower() != person.name.lower():
        raise StoreError(f"{options.import_}: this is {person.name}, not {options.person}; leave the name out")
    team = _team_with(options, person.name)
    path = person_path(_state_dir(options), person.name)
    before = _kept(path, person.name)
    after = joined(before, person)
    if content(after) == content(before):
        sys.stdout.write(f"{person.name}: all of {options.import_} is known already, and not added again\n")
        return
    write_person(path, after)
    _warn_of_robot(person.name, team)
    known = f"{plural(len(after.sentences), 'sentence')} and {plural(len(after.takes), 'word')}"
    sys.stdout.write(f"{person.name}: now known by {known}; {HOW_IT_COUNTS}\n")


def _team_with(options: argparse.Namespace, person: str) -> Team:
    """The team, with this person in it. Raises ConfigError for a name that no person can have there."""
    own = load_with_sources(options.config, name_needed=False).name
    if own is not None and own.lower() == person.lower():
        raise ConfigError(f"{own} is this robot's own name, and it obeys nobody by that name; take another")
    return load_team(options, more=(person,))


def _warn_of_robot(person: str, team: Team) -> None:
    """If it may be a robot's name."""
    if person.lower() in (name.lower() for name in team.settings.names):
        what = f"{person} is among the `names` of the settings, and counts as a person's from the next start on"
        print_note(f"warning: {what}; if it is a robot's: hvcpctl enrol {person} --remove")


def _enrol(options: argparse.Namespace, devices: Devices) -> int:
    team = _team_with(options, options.person)
    words, each_word = _wanted(options, team), options.each_word or options.words is not None
    if options.show:
        sys.stdout.writelines(f"{text}\n" for text in (words if each_word else _sentences(options.person, team)))
        return EX_OK
    path = person_path(team.settings.state_dir, options.person)
    known = _kept(path, options.person)
    report = Report()
    check = partial(check_sentence, pronounce=team.sound.lexicon.sounds)
    found: dict[str, list[Energies]] = {}
    sentences: list[SpokenSentence] = []
    if options.folder is not None:
        wavs = _wavs_in(options.folder)
        sentences = _sentences_from(wavs, _sentences(options.person, team), check, report)
        found = _words_from(wavs, words, team.phrasebook.people_graph.words, report)
    elif each_word:
        found = record_takes(words, options.takes, devices.make_stream(team.settings.audio), sys.stdout)
    else:
        wanted, stream = _sentences(options.person, team), devices.make_stream(team.settings.audio)
        sentences = record_sentences(wanted, check, stream, sys.stdout)
    found = {word: _consistent(word, takes, report) for word, takes in found.items()}
    report.other_name = other_speaker(sentences, options.person, team.names, team.sound.lexicon.sounds)
    said = sum(map(len, found.values())) + len(sentences)
    new, sentences = unknown(known, found, sentences)
    report.words, report.takes = len(new), sum(map(len, new.values()))
    report.sentences = len(sentences)
    report.known = said - report.takes - report.sentences
    person = known.with_takes(new).with_sentences(sentences)
    report.missing = sorted(set(team.phrasebook.people_graph.words) - person.takes.keys()) if person.takes else []
    report.confusable = confusable(person.takes, _competing(team, new))
    if new or sentences:
        write_person(path, person)
        _warn_of_robot(options.person, team)
    _tell(options, report, path)
    return EX_OK if said else EX_FAILURE


def _sentences(person: str, team: Team) -> dict[str, tuple[str, ...]]:
    """The sentences to say, as they are written, with their words; addressed to the robot whose microphone it is."""
    robot = next((name for name in team.names if name.lower() != person.lower()), person)
    book = team.phrasebook
    found = sentences_for(book, robot, person, team.sound.lexicon.sounds)
    return {book.write(book.parse(words)): words for words in found}


def _kept(path: Path, name: str) -> Person:
    """The person's takes. Raises StoreError for a file that cannot be used, so that none is lost silently."""
    if not is_enrolled(path):
        return Person(name)
    try:
        return read_person(path)
    except StoreError as error:
        raise StoreError(f"{error}; first remove the old takes: hvcpctl enrol {name} --remove") from error


def _competing(team: Team, found: Mapping[str, object]) -> list[tuple[str, str]]:
    """Pairs of words, one of them just said, that may be said in the same place of a sentence."""
    phrases = competing_phrases(team.phrasebook.graph)
    pairs = [(a[0], b[0]) for a, b in phrases if len(a) == len(b) == 1]
    return [(first, second) for first, second in pairs if first in found or second in found]


def _wanted(options: argparse.Namespace, team: Team) -> list[str]:
    """The words to be said, the most important ones first. Raises ConfigError for one that cannot be said."""
    known = team.phrasebook.people_graph.words
    if options.words is not None:
        wanted = [word.strip().lower() for word in options.words.split(",") if word.strip()]
        if not wanted:
            raise ConfigError(f"--words: there is no word in {options.words!r}; name some, for example --words stop,hi")
        strange = next((word for word in wanted if word not in known), None)
        if strange is not None:
            raise ConfigError(f"--words: '{strange}' is not a word of the phrasebook (all words: hvcpctl phrases)")
        return wanted
    names = [name.lower() for name in team.names]
    first = [word for word in (*FIRST, options.person.lower(), *names) if word in known]
    return list(dict.fromkeys([*first, *known]))


def _wavs_in(folder: Path) -> list[Path]:
    """Raises AudioFileError without a WAV."""
    if not folder.is_dir():
        raise AudioFileError(f"--from: {folder} is no folder; name one with sentence_1.wav or stop_1.wav")
    wavs = sorted(path for path in folder.rglob("*") if path.suffix.lower() == ".wav")
    if not wavs:
        raise AudioFileError(f"--from: there is no WAV in {folder}; name them sentence_1.wav or stop_1.wav")
    return wavs


def _words_from(
    wavs: Sequence[Path], words: Sequence[str], known: Collection[str], report: Report
) -> dict[str, list[Energies]]:
    """These words in files; reports those with the name of no `known` word, which are no sentences either."""
    found: dict[str, list[Energies]] = {}
    for path in wavs:
        if _SENTENCE.fullmatch(path.name.lower()):
            continue
        match = _NUMBERED.fullmatch(path.stem.lower())
        word = match[1] if match is not None else ""
        if word not in words:
            if word not in known:
                report.rejected.append(f"{path.name}: not named after a word of the phrasebook (WORD_1.wav)")
            continue
        take, fault = check_take(read_wav(path, pipes=False))
        if take is None:
            report.rejected.append(f"{path.name}: {fault}")
        else:
            found.setdefault(word, []).append(take)
    return {word: takes[-MAX_TAKES:] for word, takes in found.items()}


def _sentences_from(
    wavs: Sequence[Path], wanted: Mapping[str, tuple[str, ...]], check: CheckOfSentence, report: Report
) -> list[SpokenSentence]:
    """The sentences that `--show` prints, in files numbered as they are printed; reports those of other numbers."""
    found, words = [], list(wanted.values())
    for path, match in ((path, _SENTENCE.fullmatch(path.name.lower())) for path in wavs):
        if match is None:
            continue
        if not 1 <= int(match[1]) <= len(words):
            report.rejected.append(f"{path.name}: there are {len(words)} sentences: hvcpctl enrol NAME --show")
            continue
        sentence, fault = check(read_wav(path, pipes=False), words[int(match[1]) - 1])
        if sentence is None:
            report.rejected.append(f"{path.name}: {fault}")
        else:
            found.append(sentence)
    return found


def _consistent(word: str, takes: Sequence[Energies], report: Report) -> list[Energies]:
    """The takes without outliers; all of them where no two are alike, because none is known to be right."""
    odd = odd_takes(takes)
    if len(odd) == len(takes) > 1:
        report.rejected.append(f"'{word}' sounds different each time; say it again: --words {word}")
        return list(takes)
    report.rejected += [f"'{word}', take {n + 1}: unlike the others" for n in odd if len(takes) > 1]
    return [take for n, take in enumerate(takes) if n not in odd or len(takes) == 1]


def _tell(options: argparse.Namespace, report: Report, path: Path) -> None:
    name = options.person
    lines = [f"not used: {line}" for line in report.rejected]
    for first, second in report.confusable:
        lines.append(f"'{first}' and '{second}' sound alike; say them more clearly: --words {first},{second}")
    if report.other_name:
        wrong = f"they say 'I am {report.other_name}', and not '{name}'"
        lines.append(f"{name}: {wrong}; if the voice is not {name}'s: hvcpctl enrol {name} --remove")
    if report.known:
        lines.append(f"{name}: {plural(report.known, 'recording')} known already, and not added again")
    if report.sentences:
        lines.append(f"{name}: {plural(report.sentences, 'sentence')}, kept in {path}")
    if report.words:
        lines.append(f"{name}: {plural(report.words, 'word')}, {plural(report.takes, 'take')}, kept in {path}")
    if report.missing:
        more = " …" if len(report.missing) > 8 else ""
        lines.append(f"{plural(len(report.missing), 'word')} missing: {', '.join(report.missing[:8])}{more}")
    lines += [HOW_IT_COUNTS] * bool(report.words or report.sentences)
    show(options.json, {"name": name, "file": str(path), **vars(report)}, *lines)
