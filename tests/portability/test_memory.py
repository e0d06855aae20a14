"""What memory held before reaches no picture: not one bit of it, whatever the C library fills new memory with."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from clfractal.device.select import choose, is_simulator
from tests.variants import one_of

pytestmark = pytest.mark.skipif(
    sys.platform != "linux", reason="glibc alone fills memory when it is asked to"
)

_CHILD = """
import sys
import numpy as np
from clfractal.device.select import choose
from tests.portability.pictures import SIZE, picture
np.save(sys.argv[1], picture(choose(), sys.argv[2], "float32", SIZE))
"""


def _filled(name: str, byte: int, out: Path) -> np.typing.NDArray[np.float32]:
    """A picture where all new memory is full of a byte; glibc is told what that is without one."""
    environment = {**os.environ, "MALLOC_PERTURB_": str(byte ^ 0xFF)}
    subprocess.run([sys.executable, "-c", _CHILD, str(out), name], env=environment, check=True, timeout=300)
    return np.asarray(np.load(out))


# A cloud that the eye sees first, and a set that light walks within: both once had bits of what was there before.
# (Every picture of `make portability` is compared so, too.)
@pytest.mark.parametrize("name", one_of("volumes", "skin"))
def test_pictures_know_nothing_of_what_was_in_memory(name: str, tmp_path: Path) -> None:
    if is_simulator(choose().info):
        pytest.skip("a simulator takes minutes for it")
    # Zeros, and huge numbers of either sign.
    pictures = [_filled(name, byte, tmp_path / f"{byte}.npy") for byte in (0x00, 0x7F, 0xFE)]
    for picture in pictures[1:]:
        assert np.array_equal(picture, pictures[0], equal_nan=True)
    assert not np.isnan(pictures[0]).any()
