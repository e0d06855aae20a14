"""A process whose window shares its picture with OpenCL: `python -m tests.window.sharing_child SCENE MISTAKE SHOT`.

It runs the whole window, turns it by real events, goes through sizes and devices, and writes what is shown at last to SHOT.
MISTAKE is empty, or the moment at which sharing fails: `begin` (making the image) or `acquire` (later). What came of it is
written as one line of JSON.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

from benchmarks.window import Watch, opened, send, settle, stream_script
from clfractal.errors import DeviceError
from clfractal.files.png import write_png_pixels


def main() -> None:
    """See above."""
    scene, mistake, shot = sys.argv[1:]
    from clfractal.device import gl_sharing

    acquire, made = gl_sharing.SharedTexture.acquire, []

    def failing(self: gl_sharing.SharedTexture, *arguments: object) -> None:
        made.append(self)
        if mistake == "acquire" and len(made) > 3:
            raise DeviceError("the texture cannot be acquired: planted")
        acquire(self, *arguments)  # type: ignore[arg-type]

    def refused(self: gl_sharing.SharedTexture, *arguments: object) -> None:
        raise DeviceError("no image of a texture: planted")

    gl_sharing.SharedTexture.acquire = failing  # type: ignore[method-assign, assignment]
    if mistake == "begin":
        gl_sharing.SharedTexture.__init__ = refused  # type: ignore[method-assign, assignment]

    viewer = opened(scene, (), (480, 360), None)
    watch = Watch(viewer)
    began = viewer.surface.shared
    viewer.ui.show.clear()
    settle(viewer, watch.turn, 1.0)
    send(stream_script((480, 360), 1.0), watch.turn)
    settle(viewer, watch.turn, 1.0)
    import glfw

    for size in ((500, 300), (360, 240)):
        glfw.set_window_size(viewer.window.handle, *size)
        for _ in range(20):
            watch.turn()
        settle(viewer, watch.turn, 5.0)
    viewer.use_device(viewer.studio.session.device)
    viewer.act("undo_camera")
    for _ in range(20):
        watch.turn()
    settle(viewer, watch.turn, 20.0)
    messages = [message.text for message in viewer.studio.messages]
    viewer.studio.messages.clear()
    shown = viewer.surface.shown
    while shown is None or not shown.frame.finished or shown.frame.request != viewer.studio.session.newest:
        watch.turn()
        shown = viewer.surface.shown
    viewer.draw(viewer.now)
    viewer.draw(viewer.now)
    viewer.outputs.draw(viewer.surface, False, lambda by: None)
    write_png_pixels(Path(shot), viewer.outputs.read(), {})
    result = {
        "began": began,
        "shared": viewer.surface.shared,
        "way": viewer.ui.speed.way,
        "messages": messages,
        "acquired": len(made),
        "size": list(viewer.window.framebuffer),
    }
    viewer.files.save_as(Path("seen.yaml"))
    viewer.close()
    print(json.dumps(result), flush=True)


if __name__ == "__main__":
    main()
