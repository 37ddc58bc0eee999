"""The acoustic model of the natural voice: phonemes to pitch and spectra, a frame each 12.5 ms, in numpy alone.

The network is that of hibari-tts 0.2 (Apache-2.0), voice "heart", which was distilled from Kokoro-82M's af_heart
(Apache-2.0): two text encoders (depthwise convolutions, then one attention layer applied several times), a predictor
of durations, a prosody net (pitch, energy) and a decoder of ConvNeXt blocks (Liu et al., "A ConvNet for the 2020s",
CVPR 2022). The 8-bit weights are read as they were published; activations are float32, so that machines differ by
rounding only.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hvcpd.errors import ConfigError, how_to_install

Array = NDArray[np.float32]

WEIGHTS = Path(__file__).parent / "acoustic_net.npz"
"""As `release/acoustic_net.py` writes them; of the Debian packages, hvcpd-natural has them."""

FRAMES_PER_STEP = 2
"""Durations are in steps of 25 ms; the decoder has two frames in each."""

BINS = 601
"""Bins of a spectrum, 20 Hz apart, 0 to 12 kHz."""

ATTENTION_HEADS = 2
TEXT_PASSES, PROSODY_PASSES = 4, 6
"""How often the text encoders of the decoder and of the prosody net apply their one attention layer."""

PROSODY_DILATIONS = (1, 2, 4, 8, 1, 2)
DECODER_BLOCKS = 8

F0_UNIT_HZ = 100.0
"""The prosody net's unit of pitch."""


@dataclass(frozen=True)
class Acoustics:
    """The network's output for a stretch of speech, for `vocoder.sound_of`.

    `f0_hz`, shape (frames,), near 0 where there is no voice; `hidden`, shape (frames, 256), the decoder's last
    activations, of which `AcousticNet.spectra` makes spectra; `frames`, shape (phonemes,), how many frames each phoneme
    has.
    """

    f0_hz: Array
    hidden: Array
    frames: NDArray[np.int64]


class AcousticNet:
    """The network; `arrays` as in `WEIGHTS`."""

    def __init__(self, arrays: Mapping[str, NDArray[np.generic]]) -> None:
        self._arrays = arrays
        self._ready: dict[str, Array] = {}

    def _get(self, name: str) -> Array:
        """An array in float32, 8-bit ones times their scale."""
        found = self._ready.get(name)
        if found is None:
            found = self._arrays[name].astype(np.float32)
            if name + ".scale" in self._arrays:
                found *= self._arrays[name + ".scale"].astype(np.float32)
            self._ready[name] = found
        return found

    def acoustics(self, phonemes: Sequence[int], speed: float = 1.0) -> Acoustics:
        """Return what the network says of phonemes, indices of its alphabet, shape (n,); `speed` divides durations."""
        ids = np.asarray(phonemes, dtype=np.int64)
        told = self._encoded("pn.text", ids, PROSODY_PASSES)
        steps = self._durations(told, speed)
        at = np.repeat(np.arange(len(ids)), steps)
        f0_hz, energy = self._prosody(told[at])
        text = np.repeat(self._encoded("m.text", ids, TEXT_PASSES)[at], FRAMES_PER_STEP, axis=0)
        pitch = np.log1p(np.maximum(f0_hz, 0.0)) / np.float32(5.0)
        x = _convolved(np.column_stack([text, pitch, energy]), self._get("m.dec_in.weight"), self._get("m.dec_in.bias"))
        for number in range(DECODER_BLOCKS):
            x = self._block(f"m.dec.{number}", x)
        return Acoustics(f0_hz, self._normed("m.dec_norm", x), steps * FRAMES_PER_STEP)

    def spectra(self, hidden: Array, bins: NDArray[np.int64]) -> tuple[Array, Array, Array, Array, Array]:
        """Return the five parts of a spectrum at `bins`, shape (k,): arrays of shape (frames, k).

        Log magnitude and phase (in turns of half a circle, before tanh) of the voice's filter, log magnitude of noise,
        log magnitude and phase of what is neither.
        """
        columns = (np.arange(5)[:, None] * BINS + bins).ravel()
        out = hidden @ self._get("m.head.weight")[:, columns] + self._get("m.head.bias")[columns]
        parts = out.reshape(len(hidden), 5, len(bins))
        return parts[:, 0], parts[:, 1], parts[:, 2], parts[:, 3], parts[:, 4]

    def _durations(self, told: Array, speed: float) -> NDArray[np.int64]:
        """Steps for each phoneme, at least one."""
        x = _gelu(_convolved(told, self._get("pn.dur.0.weight"), self._get("pn.dur.0.bias")))
        logs = x @ self._get("pn.dur.2.weight")[0, :, 0] + self._get("pn.dur.2.bias")[0]
        return np.asarray(np.maximum(np.rint(np.expm1(logs) / np.float32(speed)), 1.0), dtype=np.int64)

    def _prosody(self, x: Array) -> tuple[Array, Array]:
        """Pitch in Hz and energy by frame from the text encoder's output by step."""
        x = x @ self._get("pn.pro_in.weight")[:, :, 0].T + self._get("pn.pro_in.bias")
        for number, dilation in enumerate(PROSODY_DILATIONS):
            x = self._block(f"pn.pro.{number}", x, dilation)
        out = x @ self._get("pn.pro_out.weight")[:, :, 0].T + self._get("pn.pro_out.bias")
        return out[:, :2].ravel() * np.float32(F0_UNIT_HZ), out[:, 2:].ravel()

    def _encoded(self, name: str, ids: NDArray[np.int64], passes: int) -> Array:
        """A text encoder's output, shape (phonemes, channels)."""
        x = self._get(f"{name}.emb.weight")[ids]
        for number in range(2):
            x = self._block(f"{name}.convs.{number}", x)
        for _ in range(passes):
            x = x + self._attention(f"{name}.attn", self._normed(f"{name}.attn.norm1", x))
            inner = _gelu(self._linear(f"{name}.attn.linear1", self._normed(f"{name}.attn.norm2", x)))
            x = x + self._linear(f"{name}.attn.linear2", inner)
        return self._normed(f"{name}.norm", x)

    def _attention(self, name: str, x: Array) -> Array:
        """Multi-head self-attention (Vaswani et al. 2017)."""
        count, channels = x.shape
        joint = x @ self._get(f"{name}.self_attn.in_proj_weight") + self._get(f"{name}.self_attn.in_proj_bias")
        heads = joint.reshape(count, 3, ATTENTION_HEADS, channels // ATTENTION_HEADS).transpose(1, 2, 0, 3)
        query, key, value = heads
        scores = query @ key.transpose(0, 2, 1) / np.float32(np.sqrt(channels // ATTENTION_HEADS))
        weights = np.exp(scores - scores.max(axis=-1, keepdims=True))
        weights /= weights.sum(axis=-1, keepdims=True)
        mixed = (weights @ value).transpose(1, 0, 2).reshape(count, channels)
        return self._linear(f"{name}.self_attn.out_proj", mixed)

    def _block(self, name: str, x: Array, dilation: int = 1) -> Array:
        """A ConvNeXt block: depthwise convolution, norm, two linear layers around a GELU, scaled, and `x` itself."""
        taps = self._get(f"{name}.dw.weight")[:, 0, :]
        reach = dilation * (taps.shape[1] // 2)
        padded = np.pad(x, ((reach, reach), (0, 0)))
        mixed = self._get(f"{name}.dw.bias") + sum(
            padded[k * dilation : k * dilation + len(x)] * taps[:, k] for k in range(taps.shape[1])
        )
        inner = _gelu(self._linear(f"{name}.pw1", self._normed(f"{name}.norm", mixed)))
        return np.asarray(x + self._get(f"{name}.gamma") * self._linear(f"{name}.pw2", inner))

    def _linear(self, name: str, x: Array) -> Array:
        return np.asarray(x @ self._get(f"{name}.weight") + self._get(f"{name}.bias"))

    def _normed(self, name: str, x: Array) -> Array:
        """Layer normalisation."""
        centred = x - x.mean(axis=-1, keepdims=True)
        scale = np.sqrt(np.mean(np.square(centred), axis=-1, keepdims=True) + np.float32(1e-5))
        return np.asarray(centred / scale * self._get(f"{name}.weight") + self._get(f"{name}.bias"))


def _convolved(x: Array, weight: Array, bias: Array) -> Array:
    """A convolution over time, same length: `x` of shape (n, in), `weight` (out, in, taps)."""
    taps = weight.shape[2]
    padded = np.pad(x, ((taps // 2, taps // 2), (0, 0)))
    beside = np.concatenate([padded[k : k + len(x)] for k in range(taps)], axis=1)
    return np.asarray(beside @ weight.transpose(2, 1, 0).reshape(-1, weight.shape[0]) + bias)


_ERF = tuple(np.float32(c) for c in (0.254829592, -0.284496736, 1.421413741, -1.453152027, 1.061405429))


def _gelu(x: Array) -> Array:
    """x · Φ(x), with the error function after Abramowitz and Stegun 7.1.26 (error below 1.5e-7)."""
    z = np.abs(x) * np.float32(np.sqrt(0.5))
    t = 1.0 / (1.0 + np.float32(0.3275911) * z)
    tail = np.zeros_like(t)
    for c in reversed(_ERF):
        tail = (tail + c) * t
    tail *= 0.5 * np.exp(-z * z)  # 1 - Φ(|x|)
    return np.asarray(np.where(x < 0.0, x * tail, x - x * tail))


def require_weights() -> None:
    """Raise ConfigError, with the remedy, where the network's weights are missing."""
    if not WEIGHTS.exists():
        remedy = how_to_install("--force-reinstall ./hvcpd-*.whl", "./hvcpd-natural_*_all.deb", str(WEIGHTS))
        raise ConfigError(f"synthesizer: natural voices are not installed: {remedy}; or set it to formant")


@lru_cache(maxsize=1)
def shared_net() -> AcousticNet:
    """The package's own network, read once. Raises ConfigError where it is missing."""
    require_weights()
    with np.load(WEIGHTS) as file:
        return AcousticNet({name: file[name] for name in file.files})
