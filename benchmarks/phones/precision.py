"""In which numbers nets are trained: PyTorch imitates those of two bytes where the processor has none (AVX512-BF16 or
AMX), and a training step then takes ten times as long or more."""

from __future__ import annotations

from pathlib import Path

import torch

_FLAGS = next(line for line in Path("/proc/cpuinfo").read_text().splitlines() if line.startswith(("flags", "Features")))

TRAINED_IN = torch.bfloat16 if "bf16" in _FLAGS else torch.float32
