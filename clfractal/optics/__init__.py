"""Where eyes are and what they see: view planes, frusta, parallax."""
