"""Thresholds of the recogniser as a whole."""

from __future__ import annotations

from dataclasses import dataclass, field

from hvcpd.recognition.activity import ActivitySettings, SegmentSettings
from hvcpd.recognition.confidence import ConfidenceCurve
from hvcpd.recognition.spotter import SpotterSettings


@dataclass(frozen=True)
class RecogniserSettings:
    """Thresholds of the recogniser; the defaults are measured with `python -m benchmarks.hearing`."""

    activity: ActivitySettings = field(default_factory=ActivitySettings)
    spotter: SpotterSettings = field(default_factory=SpotterSettings)
    segments: SegmentSettings = field(default_factory=SegmentSettings)
    wake_frames: int = 24
    """The network wakes 240 ms after the first sign of speech: long enough to have heard how loud a vowel is."""
    sleep_frames: int = 60
    """The network sleeps after 0.6 s without a sign of speech."""
    min_confidence: float = 0.8
    """Below it a sentence counts as garbled: of 1,102 right ones, most of them in noise, 49; of 253 wrong ones all but
    17 (`benchmarks/confidence.py`)."""
    max_lead_in: float = 0.4
    """A sentence must follow silence: nearer to noise than to speech in the 0.6 s before it, so that no sentence
    begins at a comma."""
    surely: float = 300.0
    """Score above which a sentence is not a chance match; chance reaches 230."""
    least_explained_surely: float = 0.015
    """Least share of the energy that was heard, which a sentence with that score must explain."""
    least_explained: float = 0.1
    """Least share of what was above the noise, which any other sentence must explain: by chance, commands were found in
    sentences at a rate that nobody knows, and explained 0.09 of them and less; right ones in babble of ten times their
    power, 0.11 and more."""
    noise_share: float = 0.1
    """Share of the tracked noise that is added to what is above it, the uncertainty of the noise estimate: at -15 dB
    nothing seems to be above it, and right sentences explain 0.15 and more."""
    confidence: ConfidenceCurve = field(default_factory=ConfidenceCurve)
    max_pause: float = 10.0
    """Most speech that a pause may pass over, in frames of it: right sentences have 7 at most in noise and rooms, and a
    name left out ("hi rex, I am Ted" as "hi, I am Ted") has 15 and more."""
    min_gain: float = 16.0
    """Least gain of a whole sentence over the filler. In noise alone words gain 4 at most; in people's talk
    to each other, where words fit well, by 10 (18 minutes, `benchmarks/rejection.py`)."""
