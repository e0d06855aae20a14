"""The panels of the window, drawn with Dear ImGui. They change the scene only through the `Studio`."""
