"""Makes `problems` importable from every test folder, and the C core the portable one: it needs no compiling."""

import os
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
os.environ.setdefault("RUMO_BACKEND", "portable")
