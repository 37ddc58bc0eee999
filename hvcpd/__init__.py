"""hvcpd: robots that coordinate by speaking English to each other, out loud."""

import os

__version__ = "0.2.0"

# Our matrices are small: a second thread gains nothing, and on a busy machine one waits for its turn while the other
# spins (five times the processor time was measured). It must be known before numpy is imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
