"""The acoustic model of the natural voice: phonemes to pitch and spectra, a frame each 12.5 ms, in numpy alone.

The network is that of hibari-tts 0.2 (Apache-2.0), voice "heart", which was distilled from Kokoro-82M's af_heart
(Apache-2.0): two text encoders (depthwise convolutions, then one attention layer applied several times), a predictor
of durations, a prosody net (pitch, energy) and a decoder of ConvNeXt blocks (Liu et al., "A ConvNet for the 2020s",
CVPR 2022). The 8-bit weights are read as they were published. Activations are float32, but those that pitch comes from
are float64: an error of pitch adds up in the phase of the pulses, and with float32 there too, machines that add in
another order differ by up to -53 dB at the end of a word; so they differ by -89 dB at most.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from io import BytesIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hvcpd.errors import ConfigError, how_to_install

Array = NDArray[np.floating]

WEIGHTS = Path(__file__).parent / "acoustic_net.npz"
"""As `release/acoustic_net.py` writes them; of the Debian packages, hvcpd-natural has them."""

WEIGHTS_SHA256 = "5cd5f3f937c33ef3d01b208e4d3ed429d045437dd5224bfdad56cb0275b6f6b0"
"""Of that file: a peer with other weights would not know the samples. As a part of this source it also has units that
were made with other weights not found any more (`unit_cache.recipe`)."""

PRECISE = "pn."
"""Weights of what tells durations and pitch begin so."""

FRAMES_PER_STEP = 2
"""Durations are in steps of 25 ms; the decoder has two frames in each."""

BINS = 601
"""Bins of a spectrum, 20 Hz apart, 0 to 12 kHz."""

ATTENTION_HEADS = 2
TEXT_PASSES, PROSODY_PASSES = 4, 6
"""How often the text encoders of the decoder and of the prosody net apply their one attention layer."""

PROSODY_DILATIONS = (1, 2, 4, 8, 1, 2)
DECODER_BLOCKS = 8

BESIDE = 30
"""Frames beside the wanted ones that are decoded too: a word is cut out with up to 10 of them, and 20 more change it by
-83 dB at most (27, by nothing)."""

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
    """The network; `arrays` as in `WEIGHTS`; those whose names begin with `precise` work in float64."""

    def __init__(self, arrays: Mapping[str, NDArray[np.generic]], precise: str = PRECISE) -> None:
        self._arrays = arrays
        self._precise = precise
        self._ready: dict[str, Array] = {}

    def _get(self, name: str) -> Array:
        """An array of weights in the precision that it works in, 8-bit ones times their scale."""
        found = self._ready.get(name)
        if found is None:
            kind = np.float64 if name.startswith(self._precise) else np.float32
            found = self._arrays[name].astype(kind)
            if name + ".scale" in self._arrays:
                found *= self._arrays[name + ".scale"].astype(kind)
            self._ready[name] = found
        return found

    def acoustics(self, phonemes: Sequence[int], speed: float = 1.0, wanted: slice = slice(None)) -> Acoustics:
        """Return what the network says of phonemes, indices of its alphabet, shape (n,); `speed` divides durations.

        Only the `wanted` ones are decoded, with `BESIDE` frames on either side; `hidden` is 0 elsewhere.
        """
        ids = np.asarray(phonemes, dtype=np.int64)
        told = self._encoded("pn.text", ids, PROSODY_PASSES)
        steps = self._durations(told, speed)
        at = np.repeat(np.arange(len(ids)), steps)
        f0_hz, energy = self._prosody(told[at])
        text = np.repeat(self._encoded("m.text", ids, TEXT_PASSES)[at], FRAMES_PER_STEP, axis=0)
        pitch = np.log1p(np.maximum(f0_hz, 0.0)) / np.float32(5.0)
        told = np.column_stack([text, pitch.astype(text.dtype), energy.astype(text.dtype)])
        frames = steps * FRAMES_PER_STEP
        ends = np.cumsum(frames)
        begin, end = max(0, (ends - frames)[wanted][0] - BESIDE), ends[wanted][-1] + BESIDE
        decoded = self._decoded(told[begin:end])
        hidden = np.zeros((len(told), decoded.shape[1]), decoded.dtype)
        hidden[begin:end] = decoded
        return Acoustics(f0_hz, hidden, frames)

    def _decoded(self, told: Array) -> Array:
        """The decoder's last activations, shape (frames, 256), of text, pitch and energy by frame."""
        x = _convolved(told, self._get("m.dec_in.weight"), self._get("m.dec_in.bias"))
        for number in range(DECODER_BLOCKS):
            x = self._block(f"m.dec.{number}", x)
        return self._normed("m.dec_norm", x)

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
        padded = _padded(x, reach)
        mixed = np.tile(self._get(f"{name}.dw.bias"), (len(x), 1))
        for k in range(taps.shape[1]):
            mixed += padded[k * dilation : k * dilation + len(x)] * taps[:, k]
        inner = _gelu(self._linear(f"{name}.pw1", self._normed(f"{name}.norm", mixed)))
        return np.asarray(x + self._get(f"{name}.gamma") * self._linear(f"{name}.pw2", inner))

    def _linear(self, name: str, x: Array) -> Array:
        return np.asarray(x @ self._get(f"{name}.weight") + self._get(f"{name}.bias"))

    def _normed(self, name: str, x: Array) -> Array:
        """Layer normalisation."""
        centred = x - np.add.reduce(x, -1, keepdims=True) / x.dtype.type(x.shape[-1])
        power = np.add.reduce(np.square(centred), -1, keepdims=True) / x.dtype.type(x.shape[-1])
        centred /= np.sqrt(power + np.float32(1e-5))
        centred *= self._get(f"{name}.weight")
        centred += self._get(f"{name}.bias")
        return centred


def _convolved(x: Array, weight: Array, bias: Array) -> Array:
    """A convolution over time, same length: `x` of shape (n, in), `weight` (out, in, taps)."""
    taps = weight.shape[2]
    padded = _padded(x, taps // 2)
    beside = np.concatenate([padded[k : k + len(x)] for k in range(taps)], axis=1)
    return np.asarray(beside @ weight.transpose(2, 1, 0).reshape(-1, weight.shape[0]) + bias)


def _padded(x: Array, count: int) -> Array:
    """`x`, shape (n, channels), with so many zeros before and after; np.pad takes ten times as long."""
    out = np.zeros((len(x) + 2 * count, x.shape[1]), x.dtype)
    out[count : count + len(x)] = x
    return out


_ERF = tuple(np.float32(c) for c in (0.254829592, -0.284496736, 1.421413741, -1.453152027, 1.061405429))


def _gelu(x: Array) -> Array:
    """x · Φ(x), with the error function after Abramowitz and Stegun 7.1.26 (error below 1.5e-7).

    It is max(x, 0) - |x|·(1 - Φ(|x|)). In place: this is a fifth of a word's time.
    """
    size = np.abs(x)
    z = size * np.float32(np.sqrt(0.5))
    t = z * np.float32(0.3275911)
    t += 1.0
    np.reciprocal(t, out=t)
    tail = t * _ERF[-1]
    for c in reversed(_ERF[:-1]):
        tail += c
        tail *= t
    z *= z
    np.exp(np.negative(z, out=z), out=z)
    tail *= z
    tail *= size
    tail *= 0.5
    return np.asarray(np.maximum(x, 0.0) - tail)


def read_weights(weights: Path = WEIGHTS) -> bytes:
    """The file of the network's weights. Raises ConfigError, with the remedy, where it is missing, damaged, or another
    version's."""
    try:
        data = weights.read_bytes()
    except OSError:
        data = b""
    if hashlib.sha256(data).hexdigest() == WEIGHTS_SHA256:
        return data
    fault, again = ("are damaged or of another version", "--reinstall ") if data else ("are not installed", "")
    remedy = how_to_install("--force-reinstall ./hvcpd-*.whl", f"{again}./hvcpd-natural_*_all.deb", str(weights))
    raise ConfigError(f"synthesizer: natural voices {fault}: {remedy}; or set it to formant")


@lru_cache(maxsize=1)
def shared_net() -> AcousticNet:
    """The package's own network, read once. Raises ConfigError as `read_weights`."""
    with np.load(BytesIO(read_weights())) as file:
        return AcousticNet({name: file[name] for name in file.files})
