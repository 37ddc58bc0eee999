"""Builds one robot from its settings: the only module that knows all packages."""

from __future__ import annotations

import random
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial

from hvcpd.assembly.plan import HearingPlan, RobotPlan
from hvcpd.assembly.rendered_waveforms import LazyMapping, WaveformBook, WaveformCache
from hvcpd.assembly.sound import Sound, make_phrasebook
from hvcpd.config.tasks import Place
from hvcpd.coordination.actions import SLOW_STRETCH, Timing
from hvcpd.coordination.coordination import Coordination
from hvcpd.hardware.kinematics import Odometry
from hvcpd.hardware.navigator import Navigator
from hvcpd.language.forms import Kind
from hvcpd.language.marks import CIPHER_CALL
from hvcpd.language.phrasebook import Phrasebook
from hvcpd.language.requests import is_harmless_request
from hvcpd.people.enrolled import Person
from hvcpd.people.phone_checks import loss_of_call, loss_of_sentence
from hvcpd.people.second_pass import SecondPassRecogniser
from hvcpd.people.stage import PeopleStage
from hvcpd.ports import Samples
from hvcpd.ranging.own_delay import OwnDelay
from hvcpd.ranging.ranging import Ranging
from hvcpd.recognition.barge_in import BargeInDetector
from hvcpd.recognition.channel.recogniser import ChannelRecogniser
from hvcpd.recognition.channel.search import ChannelSegment, SearchResult
from hvcpd.recognition.channel.stage import ChannelStage
from hvcpd.recognition.events import Source
from hvcpd.recognition.keyword.net import KeywordNet, Weights
from hvcpd.recognition.keyword.stage import KeywordRescorer, KeywordStage
from hvcpd.recognition.network import Beam
from hvcpd.recognition.shared_front_end import SharedFrontEnd
from hvcpd.recognition.stages import SpeechRecogniser, Stage, SynchronousWorker, Worker
from hvcpd.recognition.template_recogniser import RecogniserSettings, TemplateRecogniser
from hvcpd.robot.measures import Measures
from hvcpd.robot.performer import Performer
from hvcpd.robot.robot import Robot
from hvcpd.robot.sealing import Sealing
from hvcpd.security.guard import Guard
from hvcpd.synthesis.speaker import Speaker

SLOW = 1.0 / SLOW_STRETCH
"""Of the usual rate, when a robot speaks slowly; the recogniser's steps span 0.5 to 2."""

SEALED_PAIRS = 400
"""Word instances followed where any of 64 code words may come: each has two templates at three gains. With
100, as for sentences alone, most are lost (5 of 12 sealed sentences right in pink noise at 0 dB; with 300, 12)."""
MIN_SPELLED_CONFIDENCE = 0.95
"""Least confidence of a spelled name, of which one wrong letter makes another one. Spelled names have 0.98 and more
down to 0 dB; of 80 other sentences one was taken for a name, at 0.77 (`benchmarks/spelling.py`)."""

Books = Sequence[WaveformBook]
"""Words that robots say, for all listeners of one robot: each word is read and measured once."""


def make_template_recogniser(
    phrasebook: Phrasebook, names: Sequence[str], sound: Sound, strangers: bool = False
) -> TemplateRecogniser:
    """A recogniser for the voices of these robots: templates are the very signals that their synthesizers make. With
    `strangers` for names that anybody spells, too, once it is prepared."""
    speakers = {robot_voice(name, sound): name for name in names}
    bank = LazyMapping(speakers, lambda voice: word_bank(phrasebook, sound.speaker_of(speakers[voice])))
    sealed = Kind.SEALED in phrasebook.vocabulary.kinds
    settings = RecogniserSettings(beam=Beam(max_pairs=SEALED_PAIRS)) if sealed else None
    spelled = partial(make_spelling_recogniser, phrasebook, sound) if strangers else None
    return TemplateRecogniser(phrasebook.marked_graph, bank, settings, make_spelling_recogniser=spelled)


def make_waveform_books(phrasebook: Phrasebook, names: Sequence[str], sound: Sound) -> Books:
    """The words of these robots, sample by sample: at their usual rate, and slowly."""
    words, phrases = phrasebook.robots_graph.words, phrasebook.alternatives
    speakers = {robot_voice(name, sound): name for name in names}
    waveforms = WaveformCache()

    def book(voice: str, speaker: Speaker) -> WaveformBook:
        others = [name.lower() for name in phrasebook.vocabulary.names if robot_voice(name, sound) != voice]
        return WaveformBook(voice, speaker, words, waveforms, phrases, others)

    usual = [book(voice, sound.speaker_of(name)) for voice, name in speakers.items()]
    slow = [
        book(voice, sound.speaker_of(name, SLOW))
        for voice, name in speakers.items()
        if name.lower() not in sound.recorded
    ]
    return (*usual, *slow)


def robot_voice(name: str, sound: Sound) -> str:
    """The recogniser's name for a robot's voice."""
    return f"{name}, recorded" if name.lower() in sound.recorded else sound.voice_of(name).name


def voices_of(names: Iterable[str], sound: Sound, people: Mapping[str, Person]) -> dict[str, str]:
    """Return the voices of robots and of enrolled people, by name in lower case."""
    voices = {key: person.voice for key, person in people.items()}
    return {name.lower(): voices.get(name.lower()) or robot_voice(name, sound) for name in names}


def make_speech_recogniser(
    phrasebook: Phrasebook,
    names: Sequence[str],
    sound: Sound,
    hearing: HearingPlan | None = None,
    strangers: bool = False,
    books: Books | None = None,
    name: str | None = None,
) -> SpeechRecogniser:
    """A recogniser for the voices of these robots, by templates and, if `sound` has a cache, through any channel;
    by `hearing`, with a worker that finishes at once if none is given, for people; with `strangers` for spelled names,
    in any voice; and for the keyword. Unless `hearing` is prepared, some of it works only from `prepare` on. `books`:
    those of `make_waveform_books`. `name`: this robot's, to tell garbled speech that is for it."""
    hearing = hearing or HearingPlan(channel=SynchronousWorker())
    first_pass = make_template_recogniser(phrasebook, names, sound, strangers)
    if hearing.prepared:
        first_pass.prepare(lambda: True)
    stages: list[Stage] = []
    if hearing.channel is not None and sound.cache is not None:
        books = books or make_waveform_books(phrasebook, names, sound)
        stages.append(make_channel_stage(phrasebook, books, first_pass, sound, hearing.channel, hearing.prepared))
    if hearing.second is not None:
        harmless = partial(is_harmless_request, phrasebook, name) if name is not None else None
        graph, lexicon = phrasebook.people_graph, sound.lexicon
        people = SecondPassRecogniser(graph, lexicon, hearing.people, hearing.any_voice, name, harmless)
        stages.append(PeopleStage(first_pass, people, hearing.second))
    weights = Weights.load()
    rescorer = KeywordRescorer(KeywordNet(weights), first_pass.history)
    stages.append(KeywordStage(first_pass, KeywordNet(weights), rescorer, loss_of_call))
    return SpeechRecogniser(first_pass, stages)


def make_spelling_recogniser(
    phrasebook: Phrasebook, sound: Sound, front_end: SharedFrontEnd | None = None
) -> TemplateRecogniser:
    """A recogniser of spelled names, in every voice; `front_end`: that of another recogniser on the same microphone."""
    graph = phrasebook.spelling_graph
    voices = {voice.name: voice for voice in sound.every_voice()}

    def takes(voice: str, word: str) -> list[Samples]:
        return sound.speaker_in(voices[voice]).templates(word)

    bank = LazyMapping(voices, lambda voice: LazyMapping(graph.words, partial(takes, voice)))
    settings = RecogniserSettings(min_confidence=MIN_SPELLED_CONFIDENCE)
    return TemplateRecogniser(graph, bank, settings, front_end=front_end, source=Source.SPELLED)


def make_barge_in_detector() -> BargeInDetector:
    """A listener for the keyword while the robot itself speaks."""
    return BargeInDetector(KeywordNet(Weights.load()))


def word_bank(phrasebook: Phrasebook, speaker: Speaker) -> Mapping[str, list[Samples]]:
    """Return the templates of all words in a speaker's voice, and of the phrases that count as one, shape (n,) each,
    float32, made at each access."""

    def rendered(word: str) -> list[Samples]:
        phrases = phrasebook.alternatives.get(word, ())
        return speaker.templates(word) + [take for phrase in phrases for take in speaker.phrase_templates(phrase)]

    return LazyMapping(phrasebook.marked_graph.words, rendered)


def make_robot(plan: RobotPlan, sound: Sound) -> Robot:
    """A whole robot. It listens for the voices of all names but its own."""
    names, body, security = plan.team.names, plan.body, plan.security
    speech = replace(plan.role.speech, sealed=security.keys is not None, encrypted=security.encrypts)
    coordination = Coordination(
        replace(plan.role, roster=plan.roster, speech=speech),
        plan.tasks.tasks,
        random.Random(plan.seed),
        (plan.timing or Timing()).for_latency(plan.hearing.acoustics.latency_s),
        remembered=plan.memory.tasks,
        stopped=plan.memory.stopped,
        home=Place(body.home.x_m, body.home.y_m) if body.home is not None else None,
        dues=plan.memory.dues,
        changes=plan.memory.changes,
        places=plan.tasks.places,
    )
    phrasebook, recogniser = make_phrasebook_and_recogniser(plan, names, sound, plan.team.strangers)
    rate = SLOW if speech.slowly else 1.0
    return Robot(
        coordination,
        phrasebook,
        recogniser,
        sound.speaker_of(plan.role.name),
        Odometry(body.start, body.drive, body.reading),
        Performer(body.navigator or Navigator(body.drive), body.home or body.start),
        plan.hearing.acoustics,
        sound.speaker_of(plan.role.name, SLOW),
        make_barge_in_detector(),
        make_sealing(plan),
        OwnDelay(),
        voices_of(names, sound, plan.hearing.people),
        Measures(Ranging(plan.role.name, recogniser.first_pass.history), lambda name: sound.speaker_of(name, rate)),
    )


def make_sealing(plan: RobotPlan) -> Sealing | None:
    """The guard that seals and judges for the robot, if there is a key."""
    security = plan.security
    if security.keys is None:
        return None
    guard = Guard(plan.role.name, security.keys, plan.memory.counters, patience=security.patience)
    return Sealing(guard, security.encrypts, plan.roster)


def make_channel_stage(
    phrasebook: Phrasebook,
    books: Books,
    first_pass: TemplateRecogniser,
    sound: Sound,
    worker: Worker[ChannelSegment, SearchResult],
    prepared: bool,
) -> ChannelStage:
    """Return the stage that also hears these robots through an unknown channel."""
    check = partial(loss_of_sentence, sound.lexicon.sounds)
    others = set(phrasebook.marked_graph.words) - set(phrasebook.robots_graph.words)
    unmodelled = {*phrasebook.alternatives, *others, CIPHER_CALL[0]}  # a sealed message's parts are rendered one by one
    listener = ChannelRecogniser(phrasebook.robots_graph, books, prepared, check, frozenset(unmodelled))
    return ChannelStage(first_pass, listener, worker)


def phrasebook_of(plan: RobotPlan, names: Sequence[str]) -> Phrasebook:
    """The robot's phrasebook once it knows these names. Raises PhraseError."""
    teams = (*plan.team.teams, *([plan.role.team] if plan.role.team else []))
    return make_phrasebook(names, teams, plan.tasks, plan.security.keys is not None, plan.security.encrypts)


def make_phrasebook_and_recogniser(
    plan: RobotPlan, names: Sequence[str], sound: Sound, strangers: bool = False
) -> tuple[Phrasebook, SpeechRecogniser]:
    """Return a robot's phrasebook and recogniser once it knows these names; with `strangers` it also recognises others'
    names, spelled. Raises PhraseError when words clash."""
    book = phrasebook_of(plan, names)
    return book, make_speech_recogniser(book, plan.peers(names), sound, plan.hearing, strangers, name=plan.role.name)
