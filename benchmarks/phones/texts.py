"""The training texts: sentences of the phrasebook, calls, digits, single words and pieces of English prose."""

from __future__ import annotations

import ast
import random
import re
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from benchmarks.people_material import DIGITS
from benchmarks.people_rooms import requests
from hvcpd.assembly.sound import make_phrasebook
from hvcpd.config.settings import DEFAULT_TEAMS
from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import TaskDefinition, TaskRepository, default_tasks_path
from hvcpd.errors import VocabularyError
from hvcpd.language.phrasebook import Phrasebook

NAMES = tuple(
    "Ada Alan Alice Amy Anna Anton Bella Ben Bob Bot Boris Carl Carla Chloe Clara Dan David Diana Emma Eric Eva Felix "
    "Fiona Frank Fred George Grace Gus Hanna Harry Helen Hugo Ida Ivan Jack Jane Jim Joe John Julia Karen Kate Kevin "
    "Laura Leo Lily Linda Lisa Lucas Lucy Luna Marco Maria Mark Martin Max Mia Mike Mila Nina Noah Nora Olga Oliver "
    "Oscar Paul Paula Peter Rex Rita Rob Robin Rosa Ruby Sam Sara Simon Sofia Ted Theo Tim Tina Tom Toby Uma Vera "
    "Victor Walter Wendy Yara Zoe".split()
)
FREE_PHRASES = (
    "hi all",
    "who is here",
    "what is left",
    "move forward",
    "move back",
    "turn left",
    "turn right",
    "turn around",
    "come back",
    "say again",
    "what are you doing",
)
TEAMS_OF = 400
"""Phrasebooks, each of three names."""
DEFAULT_TASKS = 0.5
"""Share of usual phrasebooks with the default tasks."""
USUAL, REQUESTS = 0.5, 0.2
"""Share of usual texts that are sentences of the phrasebook, and of requests that people make among all texts."""
LONGEST = 9
"""Words of a piece of prose."""


def common_words() -> dict[str, tuple[str, ...]]:
    """Phones of the words in PocketSphinx's dictionary, without stress."""
    from pocketsphinx import get_model_path

    found: dict[str, tuple[str, ...]] = {}
    for line in Path(get_model_path("en-us/cmudict-en-us.dict")).read_text().splitlines():
        word, *phones = line.split()
        if "(" not in word:
            found[word] = tuple(phones)
    return found


@dataclass(frozen=True)
class Text:
    """Phrases of words, to be said with a pause between two phrases."""

    phrases: tuple[tuple[str, ...], ...]

    @property
    def words(self) -> tuple[str, ...]:
        return tuple(word for phrase in self.phrases for word in phrase)


def docstrings() -> list[list[str]]:
    """Runs of words in the docstrings of Python's standard library, in lower case."""
    folder = Path(ast.__file__).parent
    runs = []
    for path in sorted(folder.glob("*.py")):
        try:
            tree = ast.parse(path.read_text(encoding="utf-8"))
        except (SyntaxError, UnicodeDecodeError):
            continue
        for node in ast.walk(tree):
            if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
                text = ast.get_docstring(node) or ""
                runs += [run.lower().split() for run in re.findall(r"[A-Za-z']+(?: [A-Za-z']+)+", text)]
    if not runs:
        sys.exit(f"there is no prose in {folder}")
    return runs


class Texts:
    """Draws texts whose words' pronunciations are known."""

    def __init__(
        self, known: Mapping[str, Sequence[str]], seed: int, usual: bool = False, n_books: int = TEAMS_OF
    ) -> None:
        """`known`: phones of common words that our lexicon may lack. `usual`: robots and people have NAMES, tasks are
        mostly the default ones, and more texts are sentences of the phrasebook, which a net can learn to expect."""
        self._usual = usual
        self._chooser = random.Random(seed)
        self._runs = [kept for run in docstrings() for kept in _stretches(run, known)]
        self._common = sorted({word for run in self._runs for word in run})
        self._known = sorted(word for word in known if word.isalpha() and len(word) > 2)
        self._books = [self._book() for _ in range(n_books)]
        self._names = [name.lower() for name in NAMES]

    def _book(self) -> Phrasebook:
        """A phrasebook of other names, teams and tasks: what the net learns of them it cannot use elsewhere."""
        while True:
            with suppress(VocabularyError):  # one of the words is in every phrasebook
                return self._any_book()

    def _any_book(self) -> Phrasebook:
        chooser = self._chooser
        names = [name.capitalize() for name in chooser.sample(NAMES if self._usual else self._common, 3)]
        if self._usual and chooser.random() < DEFAULT_TASKS:
            return make_phrasebook(names, DEFAULT_TEAMS, load_tasks(default_tasks_path()))
        tasks = (" ".join(chooser.sample(self._common, chooser.randint(2, 4))) for _ in range(5))
        defined = (TaskDefinition(number, name, None, ()) for number, name in enumerate(tasks, 1))
        return make_phrasebook(names, chooser.sample(self._common, 2), TaskRepository(tuple(defined)))

    def draw(self) -> Text:
        """One text, now of one kind and now of another."""
        chooser = self._chooser
        kind = chooser.random()
        if self._usual and kind < USUAL:
            book = chooser.choice(self._books)
            me, _, person = book.vocabulary.names
            mine = requests(book, me, person, 1, chooser)[0] if kind < REQUESTS else book.phrases(book.sample(chooser))
            return Text(tuple(tuple(phrase) for phrase in mine))
        if kind < 0.28:
            return self.prose()
        if kind < 0.5:
            book = chooser.choice(self._books)
            return Text(tuple(tuple(phrase) for phrase in book.phrases(book.sample(chooser))))
        if kind < 0.78:
            words = chooser.choice((self._known, self._common))
            return Text((tuple(chooser.choice(words) for _ in range(chooser.randint(1, 6))),))
        if kind < 0.86:
            return Text((tuple(chooser.choice(DIGITS) for _ in range(chooser.choice((1, 1, 2, 4)))),))
        return Text((tuple(self._call()),))

    def prose(self) -> Text:
        """A piece of prose."""
        run = self._chooser.choice(self._runs)
        length = self._chooser.randint(min(2, len(run)), min(LONGEST, len(run)))
        begin = self._chooser.randint(0, len(run) - length)
        return Text((tuple(run[begin : begin + length]),))

    def _call(self) -> list[str]:
        chooser = self._chooser
        name = chooser.choice((*self._names, chooser.choice(self._known), "all", "team a", "team b", ""))
        kind = chooser.random()
        if kind < 0.35:
            return f"{name} stop".split()
        if kind < 0.6:
            return f"hi {chooser.choice(self._names)}".split()
        return f"{name} {chooser.choice(FREE_PHRASES)}".split()


def _stretches(run: Sequence[str], known: Mapping[str, Sequence[str]]) -> list[list[str]]:
    """The longest parts of a run of words that are all known."""
    found: list[list[str]] = [[]]
    for word in run:
        if word in known:
            found[-1].append(word)
        elif found[-1]:
            found.append([])
    return [stretch for stretch in found if len(stretch) > 1]
