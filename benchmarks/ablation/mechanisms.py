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
RECOGNISER = f"{HEARING}.template_recogniser:TemplateRecogniser"
SETTINGS = f"{HEARING}.template_recogniser:RecogniserSettings"
SESSION = f"{HEARING}.decoder_session"
ACTIVITY = f"{HEARING}.shared_front_end"
SECOND_PASS = f"{PEOPLE}.second_pass"


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
        answering(f"{SECOND_PASS}:SecondPassRecogniser.search", None),
        _files("people", "second_pass fusion phones bands"),
    ),
    Mechanism(
        "net",
        "the second look's net of phones",
        answering(f"{PEOPLE}.phones:CtcSearch.best", None),
        _files("people", "phones"),
    ),
    Mechanism(
        "templates",
        "sentences of the network of templates (it still runs: its cost is not saved)",
        answering(f"{RECOGNISER}._accepted", None),
        _files("recognition", "decoder_session decoder network templates"),
    ),
)
RULES = (
    Mechanism(
        "beginnings",
        "sentences' beginnings are sought without signs of speech",
        answering(f"{HEARING}.channel.recogniser:ChannelRecogniser.onset", None),
        _files("recognition/channel", "endpoints"),
    ),
    Mechanism(
        "known-responses",
        "what a sentence showed of the channel helps the next ones (--modes acquainted)",
        answering(f"{HEARING}.channel.recogniser:ChannelRecogniser._learn", None),
        _files("recognition/channel", "known"),
    ),
    Mechanism("follows-silence", "a sentence follows silence", defaults(SETTINGS, max_lead_in=inf)),
    Mechanism("confidence", "the least confidence of a template sentence", defaults(SETTINGS, min_confidence=0.0)),
    Mechanism("pause", "how much speech a pause may pass over", defaults(SETTINGS, max_pause=inf)),
    Mechanism("gain", "what a sentence must fit better than the filler", defaults(SETTINGS, min_gain=-inf)),
    Mechanism(
        "unheard",
        "no sentence right after lost sound",
        instead(f"{HEARING}.template_recogniser:UNHEARD_LEAD_FRAMES", 0),
    ),
    Mechanism("going-on", "a sentence ends only where no next word is cheaper", instead(f"{SESSION}:GOING_ON", inf)),
    Mechanism("late-end", "longer rests where a word may go on", instead(f"{SESSION}:LATE_END_FRAMES", 25)),
    Mechanism("end-margin", "a resting path may cost a little more", instead(f"{SESSION}:END_MARGIN", 0.0)),
    Mechanism("retune", "the templates' level follows the voice", answering(f"{SESSION}:DecoderSession._retune", None)),
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
    Mechanism(
        "segments",
        "what is too short or even is no speech",
        together(instead(f"{ACTIVITY}:MIN_SPEECH_FRAMES", 0), instead(f"{ACTIVITY}:MIN_MODULATION", 0.0)),
    ),
    Mechanism(
        "longer-wait",
        "longer waits while a sentence seems under way",
        instead(f"{ACTIVITY}:LONGER_WAIT_FRAMES", 50),
    ),
    Mechanism(
        "keyword-belief",
        "the word counts at once, whatever is said around it",
        instead(f"{HEARING}.keyword.verification:ACCEPT_PROBABILITY", 0.0),
    ),
    Mechanism(
        "keyword-residual",
        "is the word left without the sentence?",
        answering(f"{HEARING}.keyword.stage:KeywordRescorer.residual", None),
    ),
    Mechanism(
        "keyword-again",
        "an uncertain word is heard again with noise",
        answering(f"{HEARING}.keyword.stage:KeywordRescorer.with_noise", None),
    ),
    Mechanism(
        "look-surer",
        "the second look must be as sure as the robots' listener",
        instead(f"{SECOND_PASS}:MIN_STRANGERS_PROBABILITY", 0.8),
    ),
)
ALL = (*SOURCES, *RULES)
