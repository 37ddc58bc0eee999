"""Each module measures something and prints it: `python -m benchmarks.NAME`."""

import hvcpd  # noqa: F401 - chooses one thread for linear algebra, before numpy is imported
