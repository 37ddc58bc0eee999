"""`hvcpctl hear --learn-alternatives`: what the words of a recording sounded like that was not understood.

For each stretch that is garbled, the nearest sentence of the phrasebook is sought with the confidence asked of it
lowered to nothing. Each of its doubtful words is then replaced by any one to three common words, in the voice
that fitted best, and the recording is heard once more: what is heard there now sounds more like the recording than the
word does. It is proposed if it would not be taken for another word of the team's.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from hvcpd.assembly.make import make_template_recogniser, word_bank
from hvcpd.assembly.sound import Sound
from hvcpd.assembly.vocabulary import check
from hvcpd.config.names import MAX_ALTERNATIVE_WORDS
from hvcpd.control.output import print_note
from hvcpd.control.simulate.team import Team, load_team
from hvcpd.errors import PhraseError
from hvcpd.hardware.soundfile import read_wav
from hvcpd.language.graph import Arc, WordGraph, graph_of
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.ports import SAMPLE_RATE_HZ, Samples, samples_in
from hvcpd.recognition.events import Event, Garbled, Recognised
from hvcpd.recognition.network import Beam
from hvcpd.recognition.template_recogniser import RecogniserSettings, TemplateRecogniser
from hvcpd.synthesis.lexicon import common_words
from hvcpd.synthesis.speaker import UnitPosition
from hvcpd.synthesis.voices import Voice

ANYTHING = RecogniserSettings(min_confidence=0.0, max_lead_in=99.0, max_pause=1e6, min_gain=1.0)
"""Accept a sentence however badly it fits."""
FREELY = replace(ANYTHING, beam=Beam(max_pairs=2000))
"""Beam width: about 1,400 words compete in one place, and the usual 100 paths often lose the right one."""
DOUBTFUL = 0.5
"""Words of lower confidence are examined: words that were said have 0.95 and more, others 0.02."""
MOST_DOUBTFUL = 2
"""Words of a sentence that are examined, the most doubtful first; with three wrong words it is another sentence."""
Bank = Mapping[str, Mapping[str, Sequence[Samples]]]

LEAD_S = 3.0
"""Length of recording heard before the stretch, so that the noise tracker can settle: its memory."""
TAIL_S = 1.0
"""Length of recording heard after the stretch: longer than a sentence needs to end."""
MAX_SYLLABLES = 2
"""Most syllables of a word that is tried; longer ones are made of several."""


@dataclass(frozen=True)
class Proposal:
    """A phrase that sounded more like the recording than `word` of `sentence`; times are seconds of the file."""

    word: str
    phrase: tuple[str, ...]
    sentence: str
    file: str
    start_s: float
    end_s: float


def run(options: argparse.Namespace) -> None:
    """Print what to paste into the task file."""
    team = load_team(options, options.names or ())
    said = team.phrasebook.render(team.phrasebook.parse_text(options.said)) if options.said else None
    found: list[Proposal] = []
    misses = 0
    for path in options.file:
        samples = read_wav(path)
        for miss in missed(samples, team, said):
            misses += 1
            found += learn(samples, miss, team, said, path.name)
    sys.stdout.write(as_yaml(found, team) if found else "")
    if not found:
        what = f"{misses} stretches were not understood, and none is near a sentence but for a word" if misses else ""
        print_note(f"nothing to propose: {what or 'nothing in these recordings was misunderstood'}")


def _hear(recogniser: TemplateRecogniser, samples: Samples) -> list[Event]:
    return recogniser.push(samples) + recogniser.flush()


def missed(samples: Samples, team: Team, said: tuple[str, ...] | None) -> list[Event]:
    """Return the garbled stretches of a recording, shape (n,), float32 at 16 kHz; where it is known what was `said`,
    also those that were taken for something else."""
    events = _hear(make_template_recogniser(team.phrasebook, team.names, team.sound), samples)
    return [e for e in events if isinstance(e, Garbled) or (said and isinstance(e, Recognised) and e.words != said)]


def learn(samples: Samples, miss: Event, team: Team, said: tuple[str, ...] | None, file: str) -> Iterator[Proposal]:
    """Yield what the doubtful words of one stretch of a recording, shape (n,), float32 at 16 kHz, sounded like."""
    begin, piece = around(samples, miss)
    graph = graph_of(said, frozenset(range(1, len(said)))) if said else team.phrasebook.graph
    bank = bank_of(team)
    near = closest(piece, graph, bank)
    if near is None:
        return
    sentence = team.phrasebook.write(team.phrasebook.parse(near.words))
    spans = sorted(enumerate(near.spans), key=lambda pair: pair[1].confidence)[:MOST_DOUBTFUL]
    doubtful = [index for index, span in spans if span.confidence < DOUBTFUL]
    heard = {index: _sounds_like(piece, near, index, bank[near.voice], team) for index in doubtful}
    for index, phrase in _needed(near, heard):
        span = near.spans[index]
        if phrase != (span.word,):
            at_s = (begin + span.start_sample) / SAMPLE_RATE_HZ
            yield Proposal(span.word, phrase, sentence, file, at_s, (begin + span.end_sample) / SAMPLE_RATE_HZ)


def closest(piece: Samples, graph: WordGraph, bank: Bank) -> Recognised | None:
    """The likeliest sentence of the graph in a piece of a recording, shape (n,), float32 at 16 kHz, in a robot's
    voice, however badly it fits."""
    return _longest(_hear(TemplateRecogniser(graph, bank, ANYTHING), piece))


def around(samples: Samples, stretch: Event) -> tuple[int, Samples]:
    """The first sample of the piece of a recording, shape (n,), around a stretch of it, and that piece."""
    begin = max(stretch.start_sample - samples_in(LEAD_S), 0)
    return begin, samples[begin : stretch.end_sample + samples_in(TAIL_S)]


def bank_of(team: Team) -> Bank:
    """The templates of all words in the voices of the team, by voice and word; to render them takes seconds."""
    return {n: dict(word_bank(team.phrasebook, team.sound.speaker_in(v))) for n, v in team_voices(team).items()}


def _needed(near: Recognised, heard: Mapping[int, Recognised | None]) -> Iterator[tuple[int, tuple[str, ...]]]:
    """The words that must have been others, and which: a wrong word squeezes the one beside it, which is sure once the
    wrong one is replaced. `heard`: the sentence with other words in place of each doubtful one."""
    left = {index: other for index, other in heard.items() if other is not None}
    while left:
        index = max(left, key=lambda each: min(span.confidence for span in left[each].spans))
        best = left.pop(index)
        more = len(best.words) - len(near.words)
        yield index, best.words[index : index + 1 + more]
        left = {
            other: sentence
            for other, sentence in left.items()
            if best.spans[other + (more if other > index else 0)].confidence < DOUBTFUL
        }


def team_voices(team: Team) -> dict[str, Voice]:
    """The voices of the names known, each once, by what they are called."""
    voices = (team.sound.voice_of(name) for name in team.names)
    return {voice.name: voice for voice in voices}


def _longest(events: Sequence[Event]) -> Recognised | None:
    found = [e for e in events if isinstance(e, Recognised)]
    return max(found, key=lambda e: e.end_sample - e.start_sample, default=None)


def _sounds_like(
    piece: Samples, near: Recognised, index: int, known: Mapping[str, Sequence[Samples]], team: Team
) -> Recognised | None:
    """The sentence with the words that are heard instead of the one at `index` when they may be any; None when nothing
    is heard.

    As few as explain it, since several short words bend to anything.
    """
    found = None
    for n_words in range(1, MAX_ALTERNATIVE_WORDS + 1):
        heard = _heard_freely(piece, near, index, known, team, n_words)
        if heard is None:
            continue
        found, after = heard, len(heard.words) - (len(near.words) - index - 1)
        if min(span.confidence for span in heard.spans[index:after]) >= DOUBTFUL:
            break
    return found


def _heard_freely(
    piece: Samples, near: Recognised, index: int, known: Mapping[str, Sequence[Samples]], team: Team, n_words: int
) -> Recognised | None:
    """`near` heard once more with any 1 to `n_words` words instead of the one at `index`."""
    within = index + 1 < len(near.words)
    pauses = frozenset(range(1, len(near.words))) - {index + 1} if within else frozenset[int]()
    chain = graph_of(near.words, pauses)
    free = free_words(team.sound)
    speaker = team.sound.speaker_in(team_voices(team)[near.voice])
    between = [index, *range(chain.n_nodes, chain.n_nodes + n_words - 1)]
    arcs = list(chain.arcs)
    for depth, node in enumerate(between):
        targets = {index + 1, *between[depth + 1 : depth + 2]}
        arcs += [Arc(node, target, word) for word in free for target in targets if word != near.words[index]]
    graph = replace(chain, n_nodes=chain.n_nodes + n_words - 1, arcs=tuple(arcs))
    ends = (UnitPosition.MEDIAL,) if within else tuple(UnitPosition)  # who goes on makes no pause after the word
    bank = {word: speaker.templates(word, ends) for word in free} | {word: known[word] for word in near.words}
    return _longest(_hear(TemplateRecogniser(graph, {near.voice: bank}, FREELY), piece))


def free_words(sound: Sound) -> list[str]:
    """Short common words."""
    syllables = {w: sum(phone[-1] in "012" for phone in sound.lexicon.pronounce(w)) for w in common_words()}
    return sorted(word for word, count in syllables.items() if count <= MAX_SYLLABLES and word.isalpha())


def as_yaml(found: Sequence[Proposal], team: Team) -> str:
    """The key `alternatives` of a task file: the present ones, and the new ones with their sources."""
    lines, accepted = [], list(team.phrasebook.vocabulary.alternatives)
    for p in found:
        phrase = " ".join(p.phrase)
        where = f'# {p.file} {p.start_s:.2f} – {p.end_s:.2f} s, perhaps "{p.sentence}": "{phrase}" for "{p.word}"'
        pair = (p.word, phrase)
        if pair in accepted:
            lines.append(where)
            continue
        wrong = objection([*accepted, pair], team)
        lines.append(f"{where}; not proposed: {wrong}" if wrong else where)
        if wrong is None:
            accepted.append(pair)
    words = dict.fromkeys(word for word, _ in accepted)
    if words:
        lines.append("alternatives:")
    lines += [f"  {word}: [{', '.join(phrase for other, phrase in accepted if other == word)}]" for word in words]
    return "\n".join(lines) + "\n"


def objection(alternatives: Sequence[tuple[str, str]], team: Team) -> str | None:
    """Why the last of these alternatives cannot be used, or None."""
    try:
        book = Phrasebook(replace(team.phrasebook.vocabulary, alternatives=tuple(alternatives)))
    except PhraseError as error:
        return str(error)
    _, phrase = alternatives[-1]
    for confusion in check(book, team.names, team.sound, chosen_only=True):
        if confusion.confusable and phrase in (confusion.first, confusion.second):
            other = confusion.second if confusion.first == phrase else confusion.first
            return f"it would be confused with '{other}'"
    return None
