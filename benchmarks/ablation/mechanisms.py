"""The mechanisms of the ear, each with the switch that takes it out: sources of sentences, and rules about them.

A rule is taken out by the answer, or the threshold, with which it never decides anything.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from pathlib import Path

from benchmarks.ablation.switches import Switch, answering, defaults, instead, together

HEARING = "hvcpd.recognition"
PEOPLE = "hvcpd.people"
RECOGNISER = f"{HEARING}.recogniser:Recogniser"
SETTINGS = f"{HEARING}.settings:RecogniserSettings"
SPOTTER = f"{HEARING}.spotter:SpotterSettings"
SEGMENTS = f"{HEARING}.segments:SegmentSettings"
URGENT = f"{HEARING}.urgent:UrgentSettings"
COHERENT = f"{HEARING}.coherent:CoherentListener"
AGREEMENT = f"{HEARING}.agreement:Agreement"
OPINION = f"{PEOPLE}.opinion"


@dataclass(frozen=True)
class Mechanism:
    """`name`, by which it is asked for; what it does; how to do without; the files that nothing else needs."""

    name: str
    what: str
    without: Switch
    files: tuple[str, ...] = ()

    @property
    def lines(self) -> int:
        """Of those files."""
        root = Path(__file__).parents[2]
        return sum(len((root / file).read_text(encoding="utf-8").splitlines()) for file in self.files)


def _files(room: str, names: str) -> tuple[str, ...]:
    return tuple(f"hvcpd/{room}/{name}.py" for name in names.split())


SOURCES = (
    Mechanism(
        "second-look",
        "speech that the robots' listener rejects is looked at again",
        answering(f"{OPINION}:SecondOpinion.look", None),
        _files("people", "opinion judging phones spelled sphinx cepstra"),
    ),
    Mechanism(
        "net",
        "the second look's net of phones",
        answering(f"{PEOPLE}.spelled:Speller.spell", None),
        _files("people", "phones spelled"),
    ),
    Mechanism(
        "pocketsphinx",
        "PocketSphinx in the second look",
        answering(f"{OPINION}:sphinx_installed", False),
        _files("people", "sphinx"),
    ),
    Mechanism(
        "templates",
        "sentences of the network of templates (it still runs: its cost is not saved)",
        answering(f"{RECOGNISER}._judge", None),
        _files("recognition", "spotter decoder scorer network layout lattice pruning confidence templates"),
    ),
    Mechanism(
        "waveforms",
        "sentences by their waveform",
        answering("hvcpd.assembly.make:make_coherent", None),
        _files("recognition", "coherent paths beginnings onsets matched weighed agreement spared"),
    ),
    Mechanism(
        "urgent",
        'the spotter of "stop" over other talk',
        answering("hvcpd.assembly.make:make_urgent", None),
        _files("recognition", "urgent hold halting lookalike remainder"),
    ),
)
RULES = (
    Mechanism(
        "agreement-wait",
        "what the network says waits for the waveform",
        answering(f"{AGREEMENT}._follows", False),
    ),
    Mechanism(
        "agreement-garbled",
        "a waveform that is not sure counts as speech",
        answering(f"{AGREEMENT}._given_up", []),
    ),
    Mechanism(
        "spared",
        "the network waits while the waveform is followed",
        answering(f"{RECOGNISER}._spares", False),
        _files("recognition", "spared"),
    ),
    Mechanism(
        "explained",
        "a waveform must explain a share of the sound",
        answering(f"{RECOGNISER}._is_explained", True),
    ),
    Mechanism("follows-silence", "a sentence follows silence", answering(f"{RECOGNISER}._follows_silence", True)),
    Mechanism("murmur", "or a murmur", defaults(SETTINGS, murmur=0.0)),
    Mechanism("confidence", "the least confidence of a template sentence", defaults(SETTINGS, min_confidence=0.0)),
    Mechanism("margin", "another word must cost more in each place", defaults(SETTINGS, min_margin=-inf)),
    Mechanism("pause", "how much speech a pause may pass over", defaults(SETTINGS, max_pause=inf)),
    Mechanism("gain", "what a sentence must fit better than the filler", defaults(SETTINGS, min_gain=-inf)),
    Mechanism(
        "doubtful",
        "a likely sentence where nobody seemed to speak is garbled",
        defaults(SETTINGS, doubtful_confidence=inf),
    ),
    Mechanism("wake-share", "the network does not wake for clicks", defaults(SETTINGS, wake_share=0.0)),
    Mechanism("unheard", "no sentence right after lost sound", instead(f"{HEARING}.recogniser:UNHEARD_LEAD_FRAMES", 0)),
    Mechanism("going-on", "a sentence ends only where no next word is cheaper", defaults(SPOTTER, going_on=inf)),
    Mechanism(
        "late-end",
        "longer rests where a word may go on",
        defaults(SPOTTER, late_end_frames=25, hidden_end_frames=25),
    ),
    Mechanism("end-margin", "a resting path may cost a little more", defaults(SPOTTER, end_margin=0.0)),
    Mechanism("retune", "the templates' level follows the voice", defaults(SPOTTER, retune_db=inf)),
    Mechanism("template-room", "templates as in a room", instead(f"{HEARING}.templates:ROOM_RT60_S", 1e-3)),
    Mechanism(
        "noise-steps",
        "noise that steps up is followed",
        answering(f"{HEARING}.noise:NoiseTracker.follow_step", False),
    ),
    Mechanism(
        "noise-tones",
        "tones that come and go are",
        answering(f"{HEARING}.noise:NoiseTracker._follow_bands", None),
    ),
    Mechanism("noise-rise", "noise rises slowly while somebody speaks", instead(f"{HEARING}.noise:_RISE", 1e6)),
    Mechanism(
        "segments",
        "what is too short or even is no speech",
        defaults(SEGMENTS, min_frames=0, min_modulation=0.0),
    ),
    Mechanism(
        "longer-wait",
        "longer waits while a sentence seems under way",
        defaults(SEGMENTS, longer_wait_frames=50),
    ),
    Mechanism("wave-before", "a name before a sentence is sought afterwards", answering(f"{COHERENT}._before", [])),
    Mechanism(
        "wave-longer",
        "a longer word in the place of a word is awaited",
        answering(f"{COHERENT}._may_be_longer", False),
    ),
    Mechanism("wave-goes-on", "a sentence has ended only where no word follows", answering(f"{COHERENT}._look", False)),
    Mechanism(
        "wave-hopeless",
        "paths that a surer one explains are dropped",
        answering(f"{HEARING}.paths:Path.is_hopeless", False),
    ),
    Mechanism("wave-alone", "single words need more", instead(f"{HEARING}.coherent:LEAST_ALONE", 100.0)),
    Mechanism(
        "wave-score",
        "the least score of a sentence",
        together( instead(f"{HEARING}.coherent:LEAST_SCORE", 0.0), instead(f"{HEARING}.coherent:LEAST_ALONE", 0.0)),
    ),
    Mechanism(
        "hold",
        "the word counts at once, whatever is said around it",
        defaults(f"{HEARING}.hold:HoldSettings", certain_score=0.0),
    ),
    Mechanism("excuses", 'phrases that sound like "stop"', answering("hvcpd.assembly.make:_excuses", [])),
    Mechanism(
        "remainder",
        "is the word left without the sentence?",
        answering(f"{HEARING}.remainder:Remainder.explains", False),
        _files("recognition", "remainder"),
    ),
    Mechanism(
        "lookalike",
        "does the sentence show the word by itself?",
        answering(f"{HEARING}.lookalike:Lookalike.share", 0.0),
        _files("recognition", "lookalike"),
    ),
    Mechanism("drowned", "a drowned word needs more", defaults(URGENT, drowned_db=-inf)),
    Mechanism("look-snr", "no second look at faint speech", instead(f"{OPINION}:MIN_SNR_DB", -inf)),
    Mechanism(
        "look-surer",
        "the second look must be as sure as the robots' listener",
        instead(f"{OPINION}:MIN_STRANGERS_CHANCE", 0.8),
    ),
    Mechanism("look-always-sphinx", "PocketSphinx is asked only in doubt", instead(f"{OPINION}:SURELY", inf)),
)
ALL = (*SOURCES, *RULES)
