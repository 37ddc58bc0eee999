"""A second opinion on speech that the robots' recogniser rejects: of enrolled people's words, and of PocketSphinx.

Each listener's sentence gets a chance of being right from how well it fits, by a logistic curve; PocketSphinx's was
fitted to 228 fluent sentences of nine synthetic voices at 20 dB SNR, heard right, against 222 stretches of talk, of
people and synthetic voices (see docs/people.md). Where both hear the same, that counts for it: no talk made both hear
one sentence.
"""

from __future__ import annotations

import importlib.util
import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Protocol

import numpy as np

from hvcpd.language.graph import WordGraph
from hvcpd.people.ears import BEFORE_S, Piece
from hvcpd.people.enrolled import Person
from hvcpd.people.enrolled_listener import EnrolledListener
from hvcpd.people.sphinx import FRAME_SAMPLES, MOST_CALL_WORDS, Guess, Sphinx
from hvcpd.ports import SAMPLE_RATE_HZ
from hvcpd.recognition.events import Recognised, WordSpan
from hvcpd.synthesis.lexicon import Lexicon

STRANGER = "stranger"
"""What the voice is called of who is neither a robot nor enrolled."""
MIN_CHANCE = 0.8
"""As the robots' own recogniser asks for."""
SURELY_KNOWN = 0.95
"""An enrolled voice that is so sure counts even where a stranger's call for a halt would fit."""
MIN_GUESS_CHANCE = 0.55
"""Asked of a stranger's sentence. Of 228 sentences that PocketSphinx had right, 224 have it, of 124 stretches of
people's talk that addressed nobody none, and 5 of 120 of synthetic voices; with 0.8, 215, none and 1."""
GUESS_NEARER, GUESS_NEARER_AT = 4.8, -0.5
"""A stranger's sentence is likelier right than an enrolled voice's if its misfit is below this line over how far the
other is from the takes. Fitted to 189 digits of people of which one had been heard right and one had not. Asked where
an enrolled voice is not sure: 196 of 198 sentences of nine synthetic voices were right, by that voice alone 188."""
AGREEMENT = 4.0
"""Added to the logit where both listeners hear the same words, which they did in no talk that addressed nobody."""
MOST_SURE = 0.94
"""Told of what a stranger says: less than coordination asks for to move wheels without a confirmed read-back, since
words of no sentence at all, clearly spoken, have fitted as well as some that were right."""
MIN_SNR_DB = 6.0
"""Speech that is less above what was heard before it is left to the enrolled people's templates: in white noise
PocketSphinx has 34 of 40 sentences of clear voices right at 10 dB, 7 at 5 dB, none at 0 dB (docs/recognition.md)."""
URGENT = "stop"
LONGEST_CALL_S = 2.0
"""From the first to the last sound of "team plant stop", slowly."""
MOST_CALL_MISFIT, NOISE_WEIGHT = 4.9, 1.2
"""A call's misfit and so much of that of the pauses around it, where a longer sentence would hide. Of 17 sentences of
two and more words that were not calls, but as short, the least was 5.42, of 43 stretches of talk 5.11."""
SHORT_CALL_S, MOST_SHORT_MISFIT = 0.9, 7.2
"""So much where there is no time for a longer sentence: of 27 calls, all as short, each had less than 6.2; no talk was
as short."""
SURELY_ELSE = 3.3
"""Misfit of another sentence that speaks against a call: of those found in the 27 calls the least was 3.77."""
LEAST_BETTER = 0.3
"""A call fits better than any other sentence by so much: 27 calls by 0.65 and more."""
MIN_LEAD_S = 0.3
"""Of sound before the speech, to know its noise."""


def guess_chance(guess: Guess, speech_s: float) -> float:
    """How likely a sentence of `Sphinx` is right, 0 to 1, in speech of so many seconds: where few words would be spread
    over much of it, it was something else."""
    fits = 14.08 - 3.19 * guess.misfit - 0.71 * guess.worst - 0.13 * guess.noise
    return _sigmoid(fits - 0.33 * math.log(speech_s) + 1.45 * len(guess.words) / speech_s)


def _sigmoid(logit: float) -> float:
    return 1.0 / (1.0 + math.exp(-min(max(logit, -500.0), 500.0)))


def _speech_s(piece: Piece) -> float:
    return max(piece.end - piece.start, SAMPLE_RATE_HZ // 10) / SAMPLE_RATE_HZ


def _agreed(one: float, other: float) -> float:
    odds = [math.log(max(p, 1e-9) / max(1.0 - p, 1e-9)) for p in (one, other)]
    return _sigmoid(max(odds) + AGREEMENT)


class Guesses(Protocol):
    """`Sphinx`, as it is needed here."""

    def guess(self, piece: Piece) -> Guess | None: ...

    def call(self, piece: Piece) -> Guess | None: ...


class SecondOpinion:
    """Looks at pieces of sound; its listeners are made when they are first needed, in the thread that looks.

    Surest first: an enrolled voice that is sure; "stop" by anybody; an enrolled voice that is fairly sure, for strange
    sounds fit PocketSphinx's models by chance, unless those fit much better; what a stranger seems to say.
    """

    def __init__(
        self,
        graph: WordGraph,
        lexicon: Lexicon,
        people: Mapping[str, Person],
        strangers: bool,
        sphinx: Guesses | None = None,
    ) -> None:
        """`people`: those enrolled, looked up anew at each look, so that words learned meanwhile count; with
        `strangers`, PocketSphinx listens for all others, or what stands in for it."""
        self._graph = graph
        self._people = people
        self._known: tuple[Person, ...] = ()
        self._enrolled: EnrolledListener | None = None
        self._sphinx = sphinx or Sphinx(graph, lexicon, URGENT) if strangers else None

    def look(self, piece: Piece) -> Recognised | None:
        """The sentence in a piece, as sure as it is; None if none is sure enough."""
        snr_db = snr_of(piece)
        known = self._look_for_enrolled(piece)
        guess = self._guess(piece) if snr_db >= MIN_SNR_DB else None
        if known is not None:
            chance = known.confidence
            if guess is not None and known.words == guess.words:
                chance = _agreed(chance, guess_chance(guess, _speech_s(piece)))
            known = replace(known, confidence=chance, snr_db=snr_db)
            if chance >= SURELY_KNOWN:
                return known
            if guess is not None and _guess_nearer(guess, known):
                known = None
        call = self._call(piece, guess) if snr_db >= MIN_SNR_DB else None
        if call is not None:
            return _recognised(call, piece, MIN_CHANCE, snr_db)
        if known is not None and known.confidence >= MIN_CHANCE:
            return known
        return self._stranger(piece, guess, snr_db)

    def likeliest(self, piece: Piece) -> Recognised | None:
        """The sentence in a piece that is likelier right than others, however unlikely."""
        known, guess, snr_db = self._look_for_enrolled(piece), self._guess(piece), snr_of(piece)
        if guess is None or (known is not None and not _guess_nearer(guess, known)):
            return known
        return _recognised(guess, piece, guess_chance(guess, _speech_s(piece)), snr_db)

    def _guess(self, piece: Piece) -> Guess | None:
        return self._sphinx.guess(piece) if self._sphinx is not None else None

    def _stranger(self, piece: Piece, guess: Guess | None, snr_db: float) -> Recognised | None:
        """What a stranger said, if that is sure enough."""
        if guess is None or (chance := guess_chance(guess, _speech_s(piece))) < MIN_GUESS_CHANCE:
            return None
        if len(guess.words) <= MOST_CALL_WORDS and guess.words[-1] == URGENT:
            return None  # in the large network it may fit where it was no call
        return _recognised(guess, piece, chance, snr_db)

    def _call(self, piece: Piece, guess: Guess | None) -> Guess | None:
        """ "Stop" by anybody, unless it is surely something else: a halt too many does no harm."""
        if self._sphinx is None or piece.end - piece.start > LONGEST_CALL_S * SAMPLE_RATE_HZ:
            return None
        call = self._sphinx.call(piece)
        short = piece.end - piece.start <= SHORT_CALL_S * SAMPLE_RATE_HZ
        most = MOST_SHORT_MISFIT if short else MOST_CALL_MISFIT
        if call is None or call.misfit + NOISE_WEIGHT * call.noise > most:
            return None
        other = guess.misfit if guess is not None and guess.words[-1] != URGENT else math.inf
        return call if SURELY_ELSE < other >= call.misfit + LEAST_BETTER else None

    def _look_for_enrolled(self, piece: Piece) -> Recognised | None:
        words = set(self._graph.words)
        people = tuple(person for person in tuple(self._people.values()) if person.words & words)
        if not people:
            return None
        if self._enrolled is None or [*map(id, people)] != [*map(id, self._known)]:
            self._known, self._enrolled = people, EnrolledListener(self._graph, people)
        return self._enrolled.sentence(piece)


def _guess_nearer(guess: Guess, known: Recognised) -> bool:
    lengths = [span.end_sample - span.start_sample for span in known.spans]
    deficit = sum(n * span.deficit for n, span in zip(lengths, known.spans, strict=True)) / sum(lengths)
    return guess.misfit < GUESS_NEARER * deficit + GUESS_NEARER_AT


def strangers_possible() -> bool:
    """Whether PocketSphinx is installed; it is not loaded."""
    return importlib.util.find_spec("pocketsphinx") is not None


def snr_of(piece: Piece) -> float:
    """The mean power of the speech over that of what was heard before it, dB; infinite without enough of that."""
    lead = piece.sound[: piece.lead].astype(np.float64)
    if len(lead) < MIN_LEAD_S * SAMPLE_RATE_HZ:
        return math.inf
    frame = SAMPLE_RATE_HZ // 50
    # Somebody may have spoken before: the noise is what is left in the quieter parts.
    powers = np.mean(lead[: len(lead) // frame * frame].reshape(-1, frame) ** 2, axis=1)
    noise = float(np.quantile(powers, 0.3))
    speech = float(np.mean(piece.sound[piece.lead : piece.lead + piece.end - piece.start].astype(np.float64) ** 2))
    return 10.0 * math.log10(max(speech / max(noise, 1e-12) - 1.0, 1e-3))


def _recognised(guess: Guess, piece: Piece, chance: float, snr_db: float) -> Recognised:
    first = max(piece.lead - round(BEFORE_S * SAMPLE_RATE_HZ), 0) + piece.origin
    spans = tuple(
        WordSpan(word, first + start * FRAME_SAMPLES, first + end * FRAME_SAMPLES, chance)
        for word, (start, end) in zip(guess.words, guess.spans, strict=True)
    )
    sure = min(chance, MOST_SURE)
    return Recognised(guess.words, STRANGER, spans[0].start_sample, spans[-1].end_sample, sure, snr_db, spans)
