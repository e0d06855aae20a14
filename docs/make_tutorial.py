"""Makes the pictures of docs/tutorial.md by doing what it says: docs/pictures/tutorial_*.webp.

    python docs/make_tutorial.py

Writes the files that the page shows and runs its commands in a new folder, in order, those that render in `console`
blocks too. The picture `pictures/tutorial_NAME.webp` is then the reader's own NAME.png.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from make_gallery import PICTURES, WIDTH, picture, reduced, small_enough
from PIL import Image

DOCS = Path(__file__).resolve().parent
PAGE = DOCS / "tutorial.md"
FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
FILE_NAME = re.compile(r"# ([\w/]+\.yaml)\n")
SHOWN = re.compile(r"\]\(pictures/tutorial_(\w+)\.webp\)")


def follow(desk: Path) -> None:
    """Does what the page says, in the folder `desk`."""
    tool = desk / "bin" / "clfractal"
    tool.parent.mkdir()
    tool.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m clfractal "$@"\n')
    tool.chmod(0o755)
    path = f"{tool.parent}{os.pathsep}{os.environ['PATH']}"
    for word, text in FENCE.findall(PAGE.read_text("utf-8")):
        named = FILE_NAME.match(text)
        if word == "yaml" and named is not None:
            (desk / named.group(1)).parent.mkdir(exist_ok=True)
            (desk / named.group(1)).write_text(text, "utf-8")
        commands = text if word == "sh" else ""
        if word == "console":
            rendered = [line[2:] for line in text.splitlines() if line.startswith("$ clfractal render ")]
            commands = "\n".join(rendered)
        if commands:
            print(commands, flush=True)
            subprocess.run(
                ["sh", "-eu", "-c", commands], cwd=desk, check=True, env={**os.environ, "PATH": path}
            )


def main() -> None:
    """Makes all pictures of the page."""
    with tempfile.TemporaryDirectory() as folder:
        follow(Path(folder))
        for name in SHOWN.findall(PAGE.read_text("utf-8")):
            with Image.open(Path(folder) / f"{name}.png") as read:
                shown = read.convert("RGB")
            if shown.width > WIDTH:
                srgb = np.asarray(shown, np.float32) / 255
                linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
                small = reduced(linear.astype(np.float32), WIDTH)
                shown = picture(small, np.ones_like(small[..., :1]))
            content, quality = small_enough(shown)
            (PICTURES / f"tutorial_{name}.webp").write_bytes(content)
            print(f"tutorial_{name}.webp: {len(content) // 1000} kB, quality {quality}")


if __name__ == "__main__":
    main()
