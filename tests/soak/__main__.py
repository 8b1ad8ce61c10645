"""`python tests/soak STEPS --seed SEED`."""

import os
import sys
from pathlib import Path

for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(name, "1")
sys.path.insert(0, str(Path(__file__).parents[1]))

from soak.judged import main  # noqa: E402

sys.exit(main())
