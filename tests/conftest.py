"""Makes `problems` importable from every test folder, and the C core the portable one: it needs no compiling.

Tests run on all cores: matrices as small as these gain nothing from further threads.
"""

import os
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
os.environ.setdefault("RUMO_BACKEND", "portable")
for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(name, "1")
