"""Texts said near a robot: calls, words that sound like the keyword, and sentences of which it is a part."""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from benchmarks.judging import Phrases
from benchmarks.keyword.clips import KEYWORD, part_of
from benchmarks.phones.texts import NAMES
from hvcpd.assembly.sound import make_phrasebook
from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import default_tasks_path
from hvcpd.language import messages as m
from hvcpd.language.marks import SEAL_WORDS
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.language.spelling import BITS
from hvcpd.synthesis.letter_to_sound import letter_to_sound

PHONES = ("S", "T", "AA", "P")
ALIKE = tuple(
    "top shop chop crop drop hop pop mop cop prop swap stock stalk stomp stump stub stuff stab stack staff step stoop "
    "steep strap strip strop start star stark stall storm store spot spa scott slop slot stalled stand still up cup "
    "tub tap tip type tarp tarot tom todd talk taught dot dock pop-up option adopted alexa foxtrot bob rob bot robot "
    "laptop desktop rooftop treetop atop tiptop table-top start-up what's-up it's-top stopped stopping "
    "stopper stopwatch stopover unstopped best-option last-option this-top let's-talk that's-tough it's-tough "
    "ask-tom next-tom is-tom is-scott hi-scott its-up let's-hop lost-opera past-opera mist-up rest-up east-up "
    "go forward follow house on off six five four one two three yes no left right down back come".split()
)
OWN_WORDS = (
    "i have stopped",
    "rob has stopped",
    "bot has stopped",
    "hi rob i am bot i have stopped",
    "i have lost my memory i have stopped",
    "task one complete",
    "top",
    "shop",
    "up",
    "alexa",
    "foxtrot",
    "stopped",
    "stock",
    "stomp",
    "spot",
    "step",
    "start",
)

ONSETS = (*["st"] * 9, *"sp sk str sl sn t d tr sh ch sw est ast ist".split(), "")
VOWELS = tuple("a a e i o o u ee oo ai oa ou er ar or y".split())
CODAS = (*["p"] * 4, *["ck"] * 2, *["t"] * 2, *"b d g ff ss sh ch m n ng l v th pt ps ft rk rp lp mp ff ck".split(), "")
"""Of made-up words; most begin as the keyword does."""
ACCENTS = ("AA", "AE", "AH", "AO", "AW", "ER")
"""Its vowel in some accent: a Scot's "stap" is an American's "stop"."""

BEFORE_IT = tuple(
    "the bus|the next|at the last|do not|we will never|you can|where does it|he would not|did they ever|she did not|"
    "i want to|they had to|this is a tram|it will|when do we|after that they|the robot will|how can i|never".split("|")
)
AFTER_IT = tuple(
    "|is near the house|on the way|for a coffee|talking about it|at the corner|working today|the music|in the morning|"
    "by the shop|and look at that|before the bridge|to think|them from doing it|it from falling|over there".split("|")
)

MORE_NAMES = tuple(
    "Abby Alma Aria Astro Axel Bart Beth Bruno Buddy Cara Cleo Cody Coco Daisy Dash Dexter Dot Duke Echo Edgar Elsa "
    "Elton Esther Fay Finn Flo Gina Hal Hope Iris Jasper Jet Jules Justin Kit Kira Lars Lola Lotte Maggie Marvin Milo "
    "Nick Nico Otis Pat Pepper Pico Polly Poppy Quinn Ralph Rocket Roxy Scott Sparky Stan Stella Steve Stuart Tara "
    "Tess Todd Trixie Ursula Viktor Wally Willow Xena Yuri Ziggy".split()
)
"""Beside NAMES: those that sound like the keyword in part, and those that people give to robots."""
TEAMS = tuple("plant a b c garden kitchen blue red green gold north south east top stock storm spot delta star".split())
ROSTERS = 250
SEALED = 0.4
"""Share of the robots' sentences with a seal."""


def call(chooser: random.Random) -> Phrases:
    """The keyword as it is called."""
    name = chooser.choice(NAMES).lower()
    before = chooser.choices(((), (name,), ("all",), ("please",), ("robot",), (KEYWORD,)), (12, 5, 2, 1, 1, 1))[0]
    return [(*before, KEYWORD)]


def alike(known: Mapping[str, Sequence[str]]) -> list[tuple[str, ...]]:
    """Words and pairs of words that sound like it: ALIKE, and all of the dictionary that are one sound away."""
    found = [tuple(word.split("-")) for word in ALIKE]
    plain = [word for word in sorted(known) if word.isalpha() and 2 < len(word) < 12]
    for word in plain:
        phones = known[word]
        if tuple(phones[-4:]) == PHONES:
            continue
        is_near = len(phones) <= 5 and _distance(phones) <= 1
        if is_near or _has(phones, PHONES) or _has(phones, PHONES[1:]):
            found.append((word,))
    return found


def made_up(chooser: random.Random, known: Mapping[str, Sequence[str]], near: Sequence[Sequence[str]]) -> str:
    """A syllable or two that sound like the keyword in part, hold no near-word kept from the training, and are the
    keyword itself in no accent."""
    barred = [known.get(word[0], ()) for word in near if len(word) == 1 and near_part_of(word[0]) != "train"]
    barred += [(*PHONES[:2], vowel, end) for vowel in ACCENTS for end in ("P", "B")]
    while True:
        word = chooser.choice(ONSETS) + chooser.choice(VOWELS) + chooser.choice(CODAS)
        phones = [phone.rstrip("012") for phone in letter_to_sound(word)]
        heard = [phone for phone in phones if phone not in ("R", "L")]  # they colour a vowel in some accents
        if len(phones) > 1 and not any(part and (_has(phones, part) or _has(heard, part)) for part in barred):
            return word


def near_part_of(text: str) -> str:
    """The part for a word that sounds like it: those to test with are in no voice learned from. What robots say or hear
    most is always learned."""
    return "train" if text in OWN_WORDS else part_of(text)


def includes(text: str, known: Mapping[str, Sequence[str]]) -> bool:
    """Whether the keyword is heard in it, as in "stoppers": to halt for that is no error."""
    return _has([phone for word in text.split() for phone in known.get(word, ())], PHONES)


def _has(phones: Sequence[str], part: Sequence[str]) -> bool:
    return any(tuple(phones[k : k + len(part)]) == tuple(part) for k in range(len(phones)))


def _distance(phones: Sequence[str]) -> int:
    row = list(range(len(PHONES) + 1))
    for i, phone in enumerate(phones):
        left, row[0] = row[0], i + 1
        for j, other in enumerate(PHONES):
            left, row[j + 1] = row[j + 1], min(left + (phone != other), row[j] + 1, row[j + 1] + 1)
    return row[-1]


def inside(chooser: random.Random) -> Phrases:
    """A sentence with the keyword in it, which calls nobody."""
    return [f"{chooser.choice(BEFORE_IT)} {KEYWORD} {chooser.choice(AFTER_IT)}".split()]


def rosters(chooser: random.Random) -> list[Phrasebook]:
    """The phrasebooks of teams of all kinds of names, with the tasks of some task file."""
    paths = (default_tasks_path(), *sorted(Path("examples").glob("*/tasks.yaml")))
    tasks = [load_tasks(path) for path in paths]
    names = [*NAMES, *MORE_NAMES]
    return [
        make_phrasebook(chooser.sample(names, chooser.randint(2, 5)), chooser.sample(TEAMS, 3), chooser.choice(tasks))
        for _ in range(ROSTERS)
    ]


def between_robots(chooser: random.Random, books: Sequence[Phrasebook]) -> Phrases:
    """A sentence that robots say to each other, some of them with a seal."""
    book = chooser.choice(books)
    utterance = book.sample(chooser)
    if chooser.random() < SEALED:
        utterance = replace(utterance, mark=m.Seal(chooser.randrange(1 << BITS * SEAL_WORDS)))
    return book.phrases(utterance)
