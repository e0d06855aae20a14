"""The names of tone curves, apart from their arithmetic: scenes are read and checked without NumPy."""

from typing import Literal, get_args

Tone = Literal["linear", "reinhard", "agx"]
TONES: tuple[Tone, ...] = get_args(Tone)
