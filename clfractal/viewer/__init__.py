"""The window, in which scenes are explored live."""
