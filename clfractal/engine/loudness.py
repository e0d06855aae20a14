"""How loud a sound is in bands of frequencies, frame by frame of a film."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clfractal.files.sound import Sound

BANDS: Mapping[str, tuple[float, float]] = {
    "bass": (20.0, 150.0),
    "middle": (150.0, 2000.0),
    "treble": (2000.0, 16000.0),
}
"""The usual bands: lowest and highest frequency, Hz."""

# A window of two periods of the lowest usual frequency, seconds; or two frames, if they are longer.
_WINDOW = 0.1


@dataclass(frozen=True, slots=True)
class Shaping:
    """What is made of the loudness of a band.

    Attributes:
        normal: whether the loudest frame of each band becomes 1.
        threshold: what is not louder than that becomes 0; from there to 1 it is stretched.
        fade: seconds in which a beat fades to a third (1 / e); it begins at once.
        gain: a factor on all.
    """

    normal: bool = True
    threshold: float = 0.0
    fade: float = 0.15
    gain: float = 1.0


def loudness(
    sound: Sound, fps: float, frames: int, bands: Sequence[tuple[float, float]]
) -> npt.NDArray[np.float64]:
    """The loudness of bands at each frame, shape (frames, bands).

    It is the root of the mean square of the sound in the band, by the Fourier transform of a Hann window around the frame's
    time (Parseval's theorem), times the root of two: a sine at full scale has 1.

    Args:
        bands: lowest and highest frequency of each, Hz; a frequency at the upper end belongs to the next band.

    Raises:
        ValueError: a band is too narrow, or beyond the sound's frequencies.
    """
    width = 2 * max(int(sound.rate * max(_WINDOW, 2 / fps) / 2), 8)
    window = np.hanning(width + 1)[:-1]
    frequencies = np.fft.rfftfreq(width, 1 / sound.rate)
    inside = [(frequencies >= low) & (frequencies < high) for low, high in bands]
    for (low, high), chosen in zip(bands, inside, strict=True):
        if not chosen.any():
            least = sound.rate / width
            raise ValueError(
                f"{low:g}-{high:g} Hz holds no frequency that is told apart: they are {least:g} Hz apart, up to"
                f" {sound.rate / 2:g} Hz"
            )
    # Each frequency but 0 and the highest stands for two of the whole transform.
    twice = np.where((frequencies == 0) | (frequencies == sound.rate / 2), 1.0, 2.0)
    scale = twice / (width * (window**2).sum())
    found = np.zeros((frames, len(bands)))
    padded = np.concatenate([np.zeros(width // 2, np.float32), sound.samples, np.zeros(width, np.float32)])
    for frame in range(frames):
        begin = round(frame / fps * sound.rate)
        part = padded[begin : begin + width]
        if len(part) < width:
            break
        power = scale * np.abs(np.fft.rfft(window * part)) ** 2
        found[frame] = [np.sqrt(2 * power[chosen].sum()) for chosen in inside]
    return found


def shaped(levels: npt.NDArray[np.float64], fps: float, shaping: Shaping) -> npt.NDArray[np.float64]:
    """Loudness as it moves a picture; shape as given."""
    found = levels.copy()
    if shaping.normal:
        loudest = found.max(axis=0, initial=0.0)
        found /= np.where(loudest > 0, loudest, 1.0)
    found = np.maximum(found - shaping.threshold, 0.0) / (1.0 - shaping.threshold)
    if shaping.fade > 0:
        rest = np.exp(-1.0 / (fps * shaping.fade))
        for frame in range(1, len(found)):
            found[frame] = np.maximum(found[frame], rest * found[frame - 1])
    return shaping.gain * found
