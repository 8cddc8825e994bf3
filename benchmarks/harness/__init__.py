"""Code shared by the scripts of this folder: rows, ratios, tables, timing, peers."""

import os

# Two threads make a 50 x 50 product slower; must stand before NumPy is imported.
for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")
