"""A process with a hidden window that asks for what cannot be shared: `sharing_refusals.py API`.

It writes one line of JSON: which devices share, what was said of each texture that cannot be shared, and whether one that
can was shared after all that.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable

import numpy as np
from OpenGL import GL

from clfractal.device import gl_sharing, select
from clfractal.device.gl_sharing import SharedTexture
from clfractal.errors import DeviceError
from tests.viewer.sharing_child import HEIGHT, WIDTH, Painter, Window, expected, new_texture


def refusal(tried: Callable[[], object]) -> str:
    """What was said; empty if nothing was refused."""
    try:
        tried()
    except DeviceError as error:
        return str(error)
    return ""


def main(api: str) -> None:
    """Prints what came of it."""
    window = Window(api)
    handles = gl_sharing.current_handles()
    found = [select.by_key(info.index, info.key) for info in select.devices()]
    sharing = [device.info.version for device in found if gl_sharing.shares_with(device, handles)]
    device = gl_sharing.opened_with(select.choose(), handles)
    shared = SharedTexture(device, window.texture, WIDTH, HEIGHT)
    Painter(device, shared).paint(5)
    shared.close()
    shared.close()
    size = (WIDTH, HEIGHT)
    wide, incomplete = new_texture(GL.GL_RGBA16F), new_texture(complete=False)
    refused = {
        "format": refusal(lambda: SharedTexture(device, wide, *size)),
        "incomplete": refusal(lambda: SharedTexture(device, incomplete, *size)),
        "none": refusal(lambda: SharedTexture(device, 4711, *size)),
        "size": refusal(lambda: SharedTexture(device, window.texture, WIDTH + 1, HEIGHT)),
        "closed": refusal(lambda: shared.acquire(device.queue, GL.glFinish)),
    }
    # As a window does that was resized: another texture, in the same context.
    window.delete_texture()
    window.texture = new_texture()
    again = SharedTexture(device, window.texture, WIDTH, HEIGHT)
    Painter(device, again).paint(9)
    right = bool(np.array_equal(window.pixels(), expected(9)))
    again.close()
    print(json.dumps({"sharing": sharing, "refused": refused, "again": right}), flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
