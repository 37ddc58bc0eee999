"""PocketSphinx with the phrasebook's network as its grammar: hears anybody, where it is not loud and not far away.

The grammar is handed over as a finite-state network, which is what PocketSphinx compiles a JSGF into: from the JSGF
itself it did not finish compiling in 7 minutes.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hvcpd.language.graph import WordGraph
from hvcpd.people.cepstra import Bands, cepstra_of
from hvcpd.ports import Samples
from hvcpd.synthesis.lexicon import Lexicon

WIDE_BEAMS = {"beam": 1e-60, "pbeam": 1e-60, "wbeam": 1e-40}
"""PocketSphinx's own are 1e-48, 1e-48, 7e-29: of 40 sentences at 40, 20 and 12 dB in white noise these gave 40, 40 and
36, its own 37, 40 and 35, at two thirds of the cost."""
LEAST_FRAMES = 10
"""Of 10 ms. With none PocketSphinx fails, and with it all that comes after."""
MOST_PRONUNCIATIONS = 6
"""Of a word, that accents add: each costs time wherever the word may come."""

_VOWELS = frozenset("AA AE AH AO AW AY EH ER EY IH IY OW OY UH UW".split())
_ACCENTS = {"AA": ("AO",), "AE": ("AA", "AH"), "ER": ("AH",), "OW": ("AO",)}
"""Vowels as they are said in other accents than the model's American (J. C. Wells, "Accents of English", Cambridge
1982, the lexical sets LOT, TRAP, NURSE and letter, GOAT)."""


@dataclass(frozen=True)
class Guess:
    """The sentence that fits best, and how well it fits.

    `misfit` is the mean over the words' frames of how much less likely each frame is than in the best of all sounds,
    in thousandths of a natural logarithm; `noise` that of the worst pause.
    """

    words: tuple[str, ...]
    misfit: float
    noise: float


def make_decoder(graph: WordGraph, folder: Path, lexicon: Lexicon, accents: bool = False, **settings: Any) -> Any:
    """A PocketSphinx decoder with the network as its grammar, knowing our pronunciations beside its own.

    `folder` holds the grammar while this runs. `accents` adds pronunciations of other parts of the world. `settings`
    are PocketSphinx's own, such as `beam`. Raises ImportError where it is not installed.
    """
    from pocketsphinx import Decoder, get_model_path

    grammar = folder / "phrasebook.fsg"
    grammar.write_text(_grammar(graph))
    decoder = Decoder(
        hmm=get_model_path("en-us/en-us"),
        dict=get_model_path("en-us/cmudict-en-us.dict"),
        lm=None,
        loglevel="FATAL",
        **settings,
    )
    for word in graph.words:
        ours = " ".join(lexicon.sounds(word)[0])
        known = decoder.lookup_word(word)
        if known is None:
            decoder.add_word(word, ours, False)
        elif ours not in (known, *(decoder.lookup_word(f"{word}({n})") for n in range(2, 6))):
            # All programs say "bot" as we do, and not as the dictionary has it (B AO T).
            decoder.add_word(f"{word}(9)", ours, False)
        if accents:
            _add_accents(decoder, word)
    decoder.add_fsg("phrasebook", decoder.read_fsg(str(grammar)))
    decoder.activate_search("phrasebook")
    return decoder


def _grammar(graph: WordGraph) -> str:
    lines = ["FSG_BEGIN phrasebook", f"NUM_STATES {graph.n_nodes + 1}", f"START_STATE {graph.start}"]
    lines.append(f"FINAL_STATE {graph.n_nodes}")
    lines += [f"TRANSITION {arc.source} {arc.target} 1.0 {arc.word}" for arc in graph.arcs]
    lines += [f"TRANSITION {node} {graph.n_nodes} 1.0" for node in sorted(graph.finals)]
    return "\n".join([*lines, "FSG_END", ""])


def _add_accents(decoder: Any, word: str) -> None:
    numbered = (decoder.lookup_word(f"{word}({n})") for n in range(2, 10))
    known = {tuple(said.split()) for said in (decoder.lookup_word(word), *numbered) if said}
    others = dict.fromkeys(other for said in sorted(known) for other in accented(said) if other not in known)
    for number, other in enumerate(list(others)[:MOST_PRONUNCIATIONS], 20):
        decoder.add_word(f"{word}({number})", " ".join(other), False)


def accented(phones: Sequence[str]) -> Iterator[tuple[str, ...]]:
    """The same word in other accents: other vowels, and no R but before a vowel."""
    found = [tuple(phones)]
    for k, phone in enumerate(phones):
        found += [(*said[:k], other, *said[k + 1 :]) for said in found for other in _ACCENTS.get(phone, ())]
    for said in found:
        silent = {k for k, phone in enumerate(said) if phone == "R" and said[k + 1 : k + 2] not in _BEFORE_R}
        yield from (said, tuple(phone for k, phone in enumerate(said) if k not in silent))


_BEFORE_R = frozenset((vowel,) for vowel in _VOWELS)


def heard(decoder: Any, sound: Samples) -> str:
    """The sentence that a decoder takes the whole sound for, by its own front end; empty if none."""
    decoder.reinit_feat()  # it would go on with the noise of the last sound
    decoder.start_utt()
    decoder.process_raw((np.clip(sound, -1, 1) * 32767).astype("<i2").tobytes(), full_utt=True)
    decoder.end_utt()
    hypothesis = decoder.hyp()
    return hypothesis.hypstr if hypothesis else ""


class Sphinx:
    """Guesses what anybody says; made when first asked, since it takes a second and 40 MB."""

    def __init__(self, graph: WordGraph, lexicon: Lexicon) -> None:
        self._graph = graph
        self._lexicon = lexicon
        self._decoder: Any = None

    def guess(self, logs: Bands) -> Guess | None:
        """What is said in an utterance, of whose energies the logarithms are given (`logs_of`); None if it is too short
        for a word. Raises ImportError where PocketSphinx is not installed."""
        if len(logs) < LEAST_FRAMES:
            return None
        if self._decoder is None:
            self._decoder = self._made()
        decoder = self._decoder
        decoder.start_utt()
        decoder.process_cep(cepstra_of(logs).tobytes(), full_utt=True)
        decoder.end_utt()
        hypothesis = decoder.hyp()
        return _guess(list(decoder.seg())) if hypothesis and hypothesis.hypstr else None

    def _made(self) -> Any:
        with tempfile.TemporaryDirectory() as folder:
            # The search of the lattice for a better path costs a quarter of the sentences of foreign voices.
            decoder = make_decoder(self._graph, Path(folder), self._lexicon, accents=True, bestpath=False, **WIDE_BEAMS)
        settings = decoder.config
        settings["cmn"] = "none"  # ours is taken away already
        decoder.reinit_feat(settings)
        return decoder


def _guess(segments: Sequence[Any]) -> Guess | None:
    words, lost, n_frames, noise = [], 0.0, 0, 0.0
    for segment in segments:
        frames = segment.end_frame - segment.start_frame + 1
        misfit = -1000.0 * math.log(max(segment.ascore, 1e-12))
        if segment.word == "<sil>":
            noise = max(noise, misfit / frames)
        elif segment.word[0] not in "<+(":
            words.append(segment.word.partition("(")[0])
            lost += misfit
            n_frames += frames
    return Guess(tuple(words), lost / n_frames, noise) if words else None
