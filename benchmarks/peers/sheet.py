"""Their pictures and ours side by side, with all light: for eyes, and how bright they are for a table.

python -m benchmarks.peers.sheet FILE ... -o SHEET.png [--width 240 --height 180]
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image

from benchmarks.peers import theirs
from clfractal.api import render
from clfractal.errors import ClfractalError
from clfractal.exchange.mandelbulber import import_settings

Bytes = npt.NDArray[np.uint8]


def pair(path: Path, size: tuple[int, int], folder: Path) -> tuple[Bytes, Bytes]:
    """Both pictures, shape (height, width, 3).

    Raises:
        ClfractalError: ours could not be made.
        TheirsError: theirs could not.
    """
    output = folder / "theirs.png"
    output.unlink(missing_ok=True)
    theirs.picture(path, output, size, {"alpha_enabled": 0}, 120)
    with Image.open(output) as image:
        one = np.asarray(image.convert("RGB"))
    scene = import_settings(path).scene
    scene["image"] = {"width": size[0], "height": size[1]}
    return one, np.asarray(render(scene).to_image().convert("RGB"))


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="peers.sheet", description="Pictures of both programs side by side."
    )
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE")
    parser.add_argument("--width", type=int, default=240)
    parser.add_argument("--height", type=int, default=180)
    parser.add_argument("--columns", type=int, default=3)
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="SHEET.png")
    options = parser.parse_args()
    size = (options.width, options.height)
    cells = []
    print(f"{'file':50} {'theirs':>7} {'ours':>7} {'ratio':>6}")
    with tempfile.TemporaryDirectory(prefix="peers-") as folder:
        for path in options.files:
            try:
                both = pair(path, size, Path(folder))
            except (ClfractalError, theirs.TheirsError) as error:
                print(f"{path.stem[:50]:50} {error}")
                continue
            means = [float(each.mean()) for each in both]
            print(
                f"{path.stem[:50]:50} {means[0]:7.1f} {means[1]:7.1f} {means[1] / max(means[0], 0.1):6.2f}",
                flush=True,
            )
            cells.append(np.concatenate(both, axis=1))
    if not cells:
        return
    rows = -(-len(cells) // options.columns)
    sheet = Image.new("RGB", (options.columns * (2 * size[0] + 8), rows * (size[1] + 8)))
    for place, cell in enumerate(cells):
        at = (place % options.columns * (2 * size[0] + 8), place // options.columns * (size[1] + 8))
        sheet.paste(Image.fromarray(cell), at)
    sheet.save(options.output)


if __name__ == "__main__":
    main()
