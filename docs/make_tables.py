"""Makes the tables of what materials reflect that travel with the program: clfractal/tables/*.npy.

python docs/make_tables.py
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from tables_glass import found_glass
from tables_layers import found_albedos

TABLES = Path(__file__).resolve().parents[1] / "clfractal" / "tables"


def main() -> None:
    TABLES.mkdir(exist_ok=True)
    for name, found in (("layers", found_albedos()), ("glass", found_glass())):
        path = TABLES / f"{name}.npy"
        np.save(path, found.astype("<f4"))
        print(f"{path.name}: {path.stat().st_size:,} bytes")


if __name__ == "__main__":
    main()
