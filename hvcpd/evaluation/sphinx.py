"""PocketSphinx, with the phrasebook's network as its grammar or open: a peer to compare with, no part of a robot.

The grammar is handed over as a finite-state network, which is what PocketSphinx compiles a JSGF into: from the JSGF
itself it did not finish compiling in 7 minutes.
"""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import numpy as np

from hvcpd.language.graph import WordGraph
from hvcpd.ports import Samples
from hvcpd.synthesis.lexicon import Lexicon

WIDE_BEAMS = {"beam": 1e-60, "pbeam": 1e-60, "wbeam": 1e-40}
"""PocketSphinx's own are 1e-48, 1e-48, 7e-29: of 40 sentences at 40, 20 and 12 dB in white noise these gave 40, 40 and
36, its own 37, 40 and 35, at two thirds of the cost."""


def sphinx_installed() -> bool:
    """Whether PocketSphinx is installed, without loading it."""
    return importlib.util.find_spec("pocketsphinx") is not None


def make_bare_decoder(**settings: Any) -> Any:
    """A PocketSphinx decoder with its models of English phones and its dictionary, and no grammar yet. `settings` are
    PocketSphinx's own, such as `beam`. Raises ImportError where it is not installed."""
    from pocketsphinx import Decoder, get_model_path

    hmm, words = get_model_path("en-us/en-us"), get_model_path("en-us/cmudict-en-us.dict")
    return Decoder(hmm=hmm, dict=words, lm=None, loglevel="FATAL", **settings)


def make_decoder(graph: WordGraph, folder: Path, lexicon: Lexicon, **settings: Any) -> Any:
    """A PocketSphinx decoder with the network as its grammar, knowing our pronunciations beside its own.

    `folder` holds the grammar while this runs. `settings` and errors are those of `make_bare_decoder`.
    """
    grammar = folder / "phrasebook.fsg"
    grammar.write_text(_grammar(graph))
    decoder = make_bare_decoder(**settings)
    for word in graph.words:
        ours = " ".join(lexicon.sounds(word)[0])
        known = decoder.lookup_word(word)
        if known is None:
            decoder.add_word(word, ours, False)
        elif ours not in (known, *(decoder.lookup_word(f"{word}({n})") for n in range(2, 6))):
            # All programs say "bot" as we do, and not as the dictionary has it (B AO T).
            decoder.add_word(f"{word}(9)", ours, False)
    decoder.add_fsg("phrasebook", decoder.read_fsg(str(grammar)))
    decoder.activate_search("phrasebook")
    return decoder


def _grammar(graph: WordGraph) -> str:
    lines = ["FSG_BEGIN phrasebook", f"NUM_STATES {graph.n_nodes + 1}", f"START_STATE {graph.start}"]
    lines.append(f"FINAL_STATE {graph.n_nodes}")
    lines += [f"TRANSITION {arc.source} {arc.target} 1.0 {arc.word}" for arc in graph.arcs]
    lines += [f"TRANSITION {node} {graph.n_nodes} 1.0" for node in sorted(graph.finals)]
    return "\n".join([*lines, "FSG_END", ""])


def heard(decoder: Any, sound: Samples) -> str:
    """A decoder's result for the whole sound as one sentence, by its own front end; empty if none."""
    decoder.reinit_feat()  # otherwise it keeps the noise estimate of the last sound
    decoder.start_utt()
    decoder.process_raw((np.clip(sound, -1, 1) * 32767).astype("<i2").tobytes(), full_utt=True)
    decoder.end_utt()
    hypothesis = decoder.hyp()
    return hypothesis.hypstr if hypothesis else ""
