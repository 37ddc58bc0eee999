"""The natural voice's network, from its publisher's ONNX file to the arrays that the package reads.

python -m release.acoustic_net HIBARI.ONNX [FILE.npz]

To be run once, by whoever takes over a new version of hibari-tts (Apache-2.0): `pip install hibari-tts onnx`; the file
is `hibari/assets/hibari.onnx`. The 8-bit weights stay as they are, all else is kept in half precision. The digest that
it prints belongs into `acoustic_net.WEIGHTS_SHA256`.
"""

from __future__ import annotations

import argparse
import hashlib
import importlib
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hvcpd.synthesis.acoustic_net import WEIGHTS


def quantised_names(graph: Any) -> dict[str, str]:
    """The name of each 8-bit matrix by that of the bias which is added to its product."""
    constants = {array.name for array in graph.initializer}
    users: dict[str, list[Any]] = {}
    for node in graph.node:
        for name in node.input:
            users.setdefault(name, []).append(node)
    names = {}
    for node in graph.node:
        if node.op_type != "MatMulInteger":
            continue
        output = node.output[0]
        while True:
            (user, *_) = users[output]
            if user.op_type == "Add":
                break
            output = user.output[0]
        bias = next(name for name in user.input if name in constants)
        names[node.input[1].removesuffix("_quantized")] = bias.removesuffix("bias") + "weight"
    return names


def converted(graph: Any, to_array: Any) -> dict[str, np.ndarray[Any, Any]]:
    """The arrays by the names that `AcousticNet` reads; an 8-bit one's scale is filed under its name and `.scale`."""
    quantised = quantised_names(graph)
    arrays = {}
    for initializer in graph.initializer:
        name, array = initializer.name, to_array(initializer)
        base = name.removesuffix("_quantized").removesuffix("_scale").removesuffix("_zero_point")
        if base in quantised:
            if name.endswith("_zero_point"):
                if array != 0:
                    raise ValueError(f"{name} is not zero")
                continue
            key = quantised[base] + (".scale" if name.endswith("_scale") else "")
            arrays[key] = array
        elif array.dtype == np.float32:
            arrays[name] = array.astype(np.float16)
    return arrays


def main(arguments: Sequence[str]) -> int:
    """Convert the file; returns the exit status."""
    parser = argparse.ArgumentParser(prog="release.acoustic_net", description="Convert the natural voice's network.")
    parser.add_argument("network", metavar="HIBARI.ONNX")
    parser.add_argument("file", metavar="FILE.npz", nargs="?", type=Path, default=WEIGHTS)
    options = parser.parse_args(arguments)
    onnx = importlib.import_module("onnx")
    np.savez(options.file, **converted(onnx.load(options.network).graph, onnx.numpy_helper.to_array))  # type: ignore[arg-type]  # names as keywords
    data = options.file.read_bytes()
    sys.stdout.write(f"{options.file}: {len(data) / 1e6:.1f} MB, SHA-256 {hashlib.sha256(data).hexdigest()}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
