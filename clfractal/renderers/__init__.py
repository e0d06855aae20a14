"""What each kind of picture needs of a device: the text of its program and what that reads."""
