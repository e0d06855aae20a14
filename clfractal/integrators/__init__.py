"""For each kind of picture, the text of its program and the data that the program reads."""
