"""Libraries that auditwheel has worked on are loaded without their symbols, and compute as before."""

from __future__ import annotations

import ctypes
import shutil
from pathlib import Path

import numpy as np
import pytest

from release.symbols import without_symbols

LIBRARIES = Path(np.__file__).parents[1] / "numpy.libs"


@pytest.fixture
def blas(tmp_path: Path) -> Path:
    """NumPy's library for matrices, with those that it needs beside it."""
    if not LIBRARIES.is_dir():
        pytest.skip("this NumPy is not from a wheel: its libraries are the system's")
    return next(shutil.copytree(LIBRARIES, tmp_path / "numpy.libs").glob("*openblas*"))


def product(blas: Path) -> float:
    """The library's scalar product of (1, 2, 3) with itself."""
    dot = ctypes.CDLL(str(blas)).scipy_cblas_ddot64_
    dot.restype = ctypes.c_double
    vector = (ctypes.c_double * 3)(1.0, 2.0, 3.0)
    return float(dot(ctypes.c_int64(3), vector, ctypes.c_int64(1), vector, ctypes.c_int64(1)))


def test_a_library_without_symbols_is_smaller_and_computes(blas: Path) -> None:
    whole = blas.read_bytes()
    cut = without_symbols(whole)
    assert len(whole) - len(cut) > 500_000
    blas.write_bytes(cut)
    assert product(blas) == 14.0


def test_twice_is_harmless(blas: Path) -> None:
    cut = without_symbols(blas.read_bytes())
    assert without_symbols(cut) == cut


def test_what_is_no_library_is_refused() -> None:
    with pytest.raises(ValueError, match="no 64-bit little-endian ELF file"):
        without_symbols(b"#!/bin/sh\n")
