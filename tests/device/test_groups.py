"""Work-groups as large as a device takes them: no picture depends on their size."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from clfractal.device import groups
from clfractal.device.select import choose
from tests.portability.pictures import TINY_SIZE, picture


def fitting(group: tuple[int, ...], most: int, longest: tuple[int, ...]) -> tuple[int, ...]:
    """Of a device with these limits."""
    device: Any = SimpleNamespace(cl_device=SimpleNamespace(max_work_item_sizes=list(longest)))
    kernel: Any = SimpleNamespace(get_work_group_info=lambda what, of: most)
    return groups.fitting(device, kernel, group)


@pytest.mark.parametrize(
    ("group", "most", "longest", "expected"),
    [
        ((32, 8), 256, (1024, 1024, 64), (32, 8)),
        ((1, 16), 1024, (1024, 1, 1), (1, 1)),  # Apple's CPU device
        ((32, 8), 1024, (1024, 1, 1), (32, 1)),
        ((32, 8), 64, (1024, 1024, 64), (8, 8)),
        ((64, 1), 1, (4096, 4096, 4096), (1, 1)),
        ((64,), 32, (16, 16, 16), (16,)),
        ((1, 64), 0, (0, 0, 0), (1, 1)),  # nonsense of a driver
    ],
)
def test_as_large_as_the_device_takes(
    group: tuple[int, ...], most: int, longest: tuple[int, ...], expected: tuple[int, ...]
) -> None:
    assert fitting(group, most, longest) == expected


@pytest.mark.parametrize("name", ["mandelbox", "coverage"])
def test_pictures_do_not_depend_on_groups(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A surface, and a volume with all that fills it."""
    device = choose()
    usual = picture(device, name, "float32", TINY_SIZE)
    asked = []

    def one_dimension(device: Any, kernel: Any) -> tuple[int, tuple[int, ...]]:
        asked.append(kernel.function_name)
        return 2, (1024, 1, 1)

    monkeypatch.setattr(groups, "_limits", one_dimension)
    device.loaded.clear()  # and with them the kernels that know their groups
    assert np.array_equal(picture(device, name, "float32", TINY_SIZE), usual, equal_nan=True)
    device.loaded.clear()
    assert len(set(asked)) >= {"mandelbox": 1, "coverage": 3}[name]
