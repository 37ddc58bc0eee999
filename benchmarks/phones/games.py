"""Sentences by people: actors in three adventure games that Debian distributes, 7.6 h of speech.

    apt-get download flight-of-the-amazon-queen beneath-a-steel-sky drascula     # and `dpkg-deb -x FILE FILES` of each
    python -m benchmarks.phones.games FILES --out DIR/games
    python -m benchmarks.phones.transcribed DIR/games --model WHISPER

Writes DIR/games/GAME/GROUP_LINE.wav and DIR/games/queen/lines.txt, which holds all that is written in the Amazon
Queen's files. Nobody noted who speaks: a group is a dialogue of the Amazon Queen, or a scene of Beneath a Steel Sky.
How these files are made was learned from ScummVM, which plays them. Needs soundfile, for MP3.
"""

from __future__ import annotations

import argparse
import io
import re
import struct
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from benchmarks.phones.unpacked import SIGNATURE, unpacked
from benchmarks.phones.voices import resampled
from hvcpd.hardware.soundfile import write_wav
from hvcpd.ports import SAMPLE_RATE_HZ, Samples

GAME_RATE_HZ = 11025
LEAST_S = 0.4

Spoken = tuple[str, Samples]
"""A name, GROUP_LINE, and sound at GAME_RATE_HZ, full scale = 1."""


def queen_files(archive: bytes) -> Iterator[tuple[str, bytes]]:
    """Names and contents of the Amazon Queen's files ("queen.1c"): a table, then what it lists."""
    if archive[:4] != b"QTBL":
        raise ValueError("not the Amazon Queen's archive")
    (n,) = struct.unpack_from(">H", archive, 13)
    for name, _, begin, size in struct.iter_unpack(">12sBII", archive[15 : 15 + 21 * n]):
        yield name.rstrip(b"\0").decode(), archive[begin : begin + size]


def queen(folder: Path) -> Iterator[Spoken]:
    """The Amazon Queen: DIALOGUE, LINE, and J for Joe King, who is one speaker in all of them, or P for the other."""
    import soundfile

    for name, data in queen_files((folder / "queen.1c").read_bytes()):
        if name.endswith(".SB"):
            line = name.removesuffix(".SB")
            sound, _ = soundfile.read(io.BytesIO(data), dtype="float32")
            yield f"{'joe' if line[-2] == 'J' else line[:2]}_{line}", sound


def written(folder: Path) -> list[str]:
    """What is written in the Amazon Queen's dialogues and scenes: lines, and parts of lines between marks."""
    found: set[str] = set()
    for name, data in queen_files((folder / "queen.1c").read_bytes()):
        if name.endswith((".DOG", ".CUT", ".JAS", ".CRD")):
            for text in re.findall(rb"[\n -~]{4,}", data):
                parts = re.split(r"\*[A-Z]*\d*|[\n^@]", text.decode())
                # a byte before each text is its length, and may look like a letter
                found |= {line for part in parts for line in (part, part[1:]) if len(line) > 1}
    return sorted(found)


def steel_sky(folder: Path) -> Iterator[Spoken]:
    """Beneath a Steel Sky: files 50,000 to 59,999 of "sky.dsk", as "sky.dnr" lists them: after 22 bytes, packed samples
    of 8 bits."""
    listed, disk = (folder / "sky.dnr").read_bytes(), (folder / "sky.dsk").read_bytes()
    for entry in struct.iter_unpack("<H3s3s", listed[4:]):
        number, begin, size = entry[0], *(int.from_bytes(field, "little") for field in entry[1:])
        begin = (begin & 0x7FFFFF) << (4 if begin >> 23 else 0)
        data = disk[begin + 22 : begin + (size & 0x3FFFFF)]
        if 50000 <= number < 60000 and data.startswith(SIGNATURE):
            yield f"{number // 100}_{number}", of_bytes(unpacked(data))


def drascula(folder: Path) -> Iterator[Spoken]:
    """Drascula, in English by Spanish actors: files of samples of 8 bits."""
    for path in sorted((folder / "en").glob("*.ALS")):
        yield f"en_{path.stem}", of_bytes(path.read_bytes())


def of_bytes(data: bytes) -> Samples:
    """Sound of unsigned bytes, shape (n,), full scale = 1."""
    return np.asarray(np.frombuffer(data, np.uint8) / np.float32(128.0) - 1.0, np.float32)


GAMES = {"flight-of-the-amazon-queen": queen, "beneath-a-steel-sky": steel_sky, "drascula": drascula}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", type=Path, help="what the packages hold")
    parser.add_argument("--out", type=Path, required=True)
    o = parser.parse_args()
    for name, speech in GAMES.items():
        folder = next(o.files.rglob(f"scummvm/{name}"), None)
        if folder is None:
            parser.error(f"{o.files} holds no scummvm/{name}: extract the package there")
        out, n, total_s = o.out / name.split("-")[-1], 0, 0.0
        out.mkdir(parents=True, exist_ok=True)
        for line, sound in speech(folder):
            if len(sound) > LEAST_S * GAME_RATE_HZ:
                write_wav(out / f"{line}.wav", resampled(sound, GAME_RATE_HZ / SAMPLE_RATE_HZ))
                n, total_s = n + 1, total_s + len(sound) / GAME_RATE_HZ
        print(f"{name}: {n} lines, {total_s / 3600:.2f} h", flush=True)
        if speech is queen:
            (out / "lines.txt").write_text("\n".join(written(folder)) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
