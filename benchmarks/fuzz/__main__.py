"""Fuzzes the parsers of external input with a coverage-guided fuzzer.

    pip install atheris
    python -m benchmarks.fuzz TARGET [--seconds 600] [--corpus DIR]

One process a target. A parser may give a result or refuse with the error that it promises; any other exception ends the
run, and its bytes are written to a file `crash-…` in the corpus's folder. What was found has become tests.
"""

from __future__ import annotations

import argparse
import contextlib
import sys
import tempfile
from pathlib import Path

import atheris

MAX_BYTES = 16 * 1024
"""Of one input: larger ones are slower and no deeper."""
SLOW_S = 20
"""One input that takes so long is a finding, too."""
MOST_MB = 1500
"""An input that takes more memory is a fault, too."""


def main() -> None:
    with atheris.instrument_imports(include=["hvcpd", "yaml", "json", "benchmarks.fuzz.targets"]):
        from benchmarks.fuzz.targets import TARGETS
        from hvcpd.errors import HvcpdError
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("target", choices=TARGETS)
    parser.add_argument("--seconds", type=int, default=600)
    parser.add_argument("--corpus", type=Path)
    options = parser.parse_args()
    target = TARGETS[options.target]
    with tempfile.TemporaryDirectory() as scratch:
        corpus: Path = options.corpus or Path(scratch) / "corpus"
        corpus.mkdir(parents=True, exist_ok=True)
        for number, seed in enumerate(target.seeds):
            (corpus / f"seed-{number}").write_bytes(seed)
        file = Path(scratch) / "input"
        file.with_name("boot").write_text("b")

        def once(data: bytes) -> None:
            with contextlib.suppress(HvcpdError):
                target.run(data, file)

        limits = [f"-max_total_time={options.seconds}", f"-max_len={MAX_BYTES}", f"-timeout={SLOW_S}"]
        places = [f"-rss_limit_mb={MOST_MB}", f"-artifact_prefix={corpus}/", str(corpus), "-print_final_stats=1"]
        atheris.Setup([sys.argv[0], *limits, *places], once)
        atheris.Fuzz()


if __name__ == "__main__":
    main()
