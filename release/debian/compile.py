"""Compiles the installed modules, as the service cannot write where they lie: compile.py FOLDER.

Not what only simulations load, which compile it each time (0.9 MB). What the daemon loads without its docstrings, as it
is with `python -OO`: 2.3 MB less of the card, and 2.5 MB less memory of the listening daemon, NumPy's most of it.
"""

import sys
from importlib.util import cache_from_source
from pathlib import Path
from py_compile import compile

OF_DAEMON = {"attr", "cattrs", "hvcpd", "numpy", "structlog", "typing_extensions.py", "yaml"}

libraries = Path(sys.argv[1])
for path in libraries.rglob("*.py"):
    parts = path.relative_to(libraries).parts
    if parts[0] != "hil_fakes" and parts[:2] != ("hvcpd", "evaluation"):
        compile(str(path), cache_from_source(path), optimize=2 if parts[0] in OF_DAEMON else 0)
