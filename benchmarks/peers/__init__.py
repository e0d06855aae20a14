"""How near imported scenes are to the pictures that the installed Mandelbulber 2 renders of the same files."""
