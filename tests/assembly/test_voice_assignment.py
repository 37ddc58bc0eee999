"""Robots speak with the voices that settings choose, and the others listen for those."""

from __future__ import annotations

import os
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

from hil_fakes.room import PinkNoise
from hvcpd.assembly.make import make_robot, make_template_recogniser
from hvcpd.assembly.plan import RobotPlan, TeamPlan
from hvcpd.assembly.sound import Sound, make_phrasebook, make_sound, user_cache_folder
from hvcpd.assembly.voice_assignment import assign_voices
from hvcpd.config.names import VoiceName
from hvcpd.config.settings import PeerSettings, Settings
from hvcpd.config.task_file import load_tasks
from hvcpd.config.tasks import default_tasks_path
from hvcpd.coordination.actions import Role
from hvcpd.daemon.wiring import wire_up
from hvcpd.errors import ConfigError
from hvcpd.hardware.soundfile import write_wav
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.recognition.events import Recognised
from hvcpd.robot.records import HeardRecord
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.speaker import Speaker, UnitPosition
from hvcpd.synthesis.voices import VOICES, voice_for, voice_named

LEXICON = Lexicon.load()
WORDS = ("hi", "i", "am", "rob")
SENTENCE = (("hi",), ("i", "am", "rob"))


def in_words(folder: Path, voice: str, *words: str) -> Path:
    """A folder of words "recorded" from a synthetic voice, as a person's would be: silence around them, any level."""
    folder.mkdir()
    speaker = Speaker(voice_named(voice), LEXICON)
    for word in words:
        write_wav(folder / f"{word}.wav", np.pad(0.3 * speaker.unit(word, UnitPosition.FINAL), 3000))
    return folder


def heard(settings: Settings, sound: Samples, noise: Samples | None = None) -> list[tuple[str, ...]]:
    """What a robot with these settings understands of a sound, with a second before and after it, in quiet or noise."""
    tasks = load_tasks(settings.tasks)
    book = make_phrasebook(settings.names, settings.teams, tasks)
    team_sound = assign_voices(make_sound(None, user_cache_folder(), settings.accent), settings, tuple)
    recogniser = make_template_recogniser(book, [n for n in settings.names if n != settings.name], team_sound)
    if noise is None:
        noise = 1e-3 * np.random.default_rng(5).standard_normal(len(sound) + 2 * SAMPLE_RATE_HZ).astype(np.float32)
    noise[SAMPLE_RATE_HZ : SAMPLE_RATE_HZ + len(sound)] += sound
    events = [*recogniser.push(noise), *recogniser.flush()]
    return [event.words for event in events if isinstance(event, Recognised)]


def test_the_settings_know_exactly_the_voices_that_there_are() -> None:
    assert get_args(VoiceName) == tuple(voice.name for voice in VOICES)


def test_a_chosen_voice_stands_over_the_one_of_the_name() -> None:
    sound = assign_voices(
        Sound(LEXICON), Settings(name="Rob", voice="oak", peers={"Bot": PeerSettings(voice="cedar")}), tuple
    )
    assert sound.speaker_of("rob").voice == voice_named("oak")
    assert sound.voice_of("BOT") == voice_named("cedar")
    assert sound.voice_of("Max") == voice_for("Max")
    assert sound.speaker_of("Rob", 0.8).voice.rate == pytest.approx(0.8 * voice_named("oak").rate)


@pytest.mark.slow
def test_a_peer_is_heard_in_the_voice_that_it_was_given() -> None:
    said = Speaker(voice_named("granite"), LEXICON).render(SENTENCE)
    told = Settings(name="Bot", peers={"Rob": PeerSettings(voice="granite")})
    assert heard(told, 0.2 * said) == [("hi", "i", "am", "rob")]


def test_pitch_and_rate_are_multiples_of_the_voices_own_and_make_another_voice() -> None:
    settings = Settings(name="Rob", voice="oak", pitch=1.1, peers={"Bot": PeerSettings(voice="oak", rate=0.9)})
    sound = assign_voices(Sound(LEXICON), settings, tuple)
    oak, rob, bot = voice_named("oak"), sound.voice_of("Rob"), sound.voice_of("Bot")
    assert (rob.f0_hz, rob.rate) == (pytest.approx(1.1 * oak.f0_hz), oak.rate)
    assert (bot.f0_hz, bot.rate) == (oak.f0_hz, pytest.approx(0.9 * oak.rate))
    assert len({oak.name, rob.name, bot.name}) == 3, "listeners tell voices apart by name"


@pytest.mark.slow
@pytest.mark.parametrize(("pitch", "rate"), [(0.8, 1.25), (1.25, 0.8)])
def test_a_peer_is_heard_at_the_pitch_and_rate_that_it_was_given(pitch: float, rate: float) -> None:
    """Even where another robot has that voice unchanged."""
    rob = PeerSettings(voice="wren", pitch=pitch, rate=rate)
    told = Settings(name="Bot", names=("Rob", "Bot", "Mia"), peers={"Rob": rob, "Mia": PeerSettings(voice="wren")})
    said = assign_voices(Sound(LEXICON), told, tuple).speaker_of("Rob").render(SENTENCE)
    assert heard(told, 0.2 * said) == [("hi", "i", "am", "rob")]


@pytest.mark.slow
@pytest.mark.parametrize("snr_db", [None, 0.0])
def test_robots_with_a_british_accent_understand_one_another(snr_db: float | None) -> None:
    bot = Settings(name="Bot", accent="gb")
    rob = make_sound(None, user_cache_folder(), "gb").speaker_of("Rob")
    book = make_phrasebook(bot.names, bot.teams, load_tasks(bot.tasks))
    for text in ("Hi Bot, I am Rob, task four complete", "Hi Bot, I am Rob, water the yellow rose"):
        utterance = book.parse_text(text)
        said = 0.2 * rob.render(book.phrases(utterance))
        level = float(np.sqrt(np.mean(said**2))) * 10.0 ** (-snr_db / 20.0) if snr_db is not None else 1e-3
        found = heard(bot, said, PinkNoise(level, 3).take(len(said) + 2 * SAMPLE_RATE_HZ).copy())
        assert found == [book.render(utterance)]


def test_natural_voices_have_no_british_accent() -> None:
    settings = Settings(name="Rob", accent="gb", synthesizer="natural")
    with pytest.raises(ConfigError, match=r"\Aaccent: natural voices are American.*\Z"):
        assign_voices(make_sound(accent=settings.accent), settings, tuple)


def test_recordings_are_spoken_and_make_templates(tmp_path: Path) -> None:
    folder = in_words(tmp_path / "mine", "willow", *WORDS)
    sound = assign_voices(Sound(LEXICON), Settings(name="Rob", voice="oak", voice_folder=folder), lambda: WORDS)
    speaker = sound.speaker_of("Rob", 0.8)
    spoken = speaker.unit("rob", UnitPosition.MEDIAL)
    theirs = Speaker(voice_named("willow"), LEXICON).unit("rob", UnitPosition.FINAL)
    assert len(speaker.render(SENTENCE)) > 0.5 * SAMPLE_RATE_HZ
    assert np.max(np.correlate(spoken, theirs, "full")) > 0.9 * np.linalg.norm(spoken) * np.linalg.norm(theirs)
    medial, final = speaker.templates("rob")
    assert len(medial) < len(final) < len(spoken)
    assert np.array_equal(final[: len(medial)], medial)


def test_a_name_without_a_recording_is_synthesized(tmp_path: Path) -> None:
    folder = in_words(tmp_path / "mine", "willow", *WORDS)
    speaker = assign_voices(
        Sound(LEXICON), Settings(name="Rob", voice="oak", voice_folder=folder), lambda: WORDS
    ).speaker_of("Rob")
    oak = Speaker(voice_named("oak"), LEXICON)
    assert np.array_equal(speaker.unit("zorg", UnitPosition.FINAL), oak.unit("zorg", UnitPosition.FINAL))
    assert [len(t) for t in speaker.templates("zorg")] == [len(t) for t in oak.templates("zorg")]


def test_a_pipe_among_the_recordings_is_refused_and_waits_for_no_writer(tmp_path: Path) -> None:
    folder = in_words(tmp_path / "mine", "willow", *WORDS)
    (folder / "rob.wav").unlink()
    os.mkfifo(folder / "rob.wav")
    with pytest.raises(ConfigError, match=r"voice_folder: .*rob\.wav: a pipe"):
        assign_voices(Sound(LEXICON), Settings(name="Rob", voice_folder=folder), lambda: WORDS)


def test_every_word_that_a_folder_lacks_is_told_at_once(tmp_path: Path) -> None:
    folder = in_words(tmp_path / "mine", "oak", "hi")
    peers = {"Bot": PeerSettings(voice_folder=tmp_path / "nowhere")}
    with pytest.raises(ConfigError) as error:
        wire_up(Settings(name="Rob", voice_folder=folder, peers=peers, state_dir=tmp_path))
    lines = str(error.value).splitlines()
    assert len(lines) == 2
    assert "no recording of" in lines[1]
    assert "am" in lines[1]
    assert "nowhere: there is no such folder" in lines[0]
    assert lines[0].startswith("peers.Bot.voice_folder: "), "it was told as the robot's own"
    assert lines[1].startswith(f"voice_folder: {folder}")


def test_a_robot_that_learned_a_name_listens_for_its_voice_after_a_restart() -> None:
    role = Role("Rob", "plant", volunteer=False)
    tasks = load_tasks(default_tasks_path())
    sound = make_sound(None, user_cache_folder())
    robot = make_robot(RobotPlan(role, TeamPlan(("Rob", "Bot", "Gus"), ("Rob", "Bot")), tasks, 1), sound)
    greeting = robot.phrasebook.phrases(robot.phrasebook.parse_text("Hi all, I am Gus"))
    quiet = np.zeros(2 * SAMPLE_RATE_HZ, np.float32)
    noise = np.random.default_rng(1).normal(0.0, 1e-4, 10 * SAMPLE_RATE_HZ).astype(np.float32)
    said = np.concatenate([quiet[:8000], 0.1 * sound.speaker_of("Gus").render(greeting), quiet])
    heard = [
        record.voice
        for at in range(0, len(said) - 400, 400)
        for record in robot.step(said[at : at + 400] + noise[at : at + 400], None).records
        if isinstance(record, HeardRecord)
    ]
    assert heard == [voice_for("Gus").name]
    assert robot.coordination.role.roster == ("Rob", "Bot")


@pytest.mark.slow
def test_a_team_of_natural_voices_hears_its_own() -> None:
    settings = Settings(name="Rob", names=("Rob", "Bot"), synthesizer="natural")
    bot = assign_voices(make_sound(None, user_cache_folder()), settings, tuple).voice_of("Bot")
    assert bot.natural
    assert bot.name == voice_for("Bot").name
    assert heard(settings, Speaker(bot, LEXICON).render((("hi",), ("i", "am", "bot")))) == [("hi", "i", "am", "bot")]
