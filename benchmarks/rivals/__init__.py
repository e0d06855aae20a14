"""Other ways to get the same picture; each is optional and says why when it cannot run."""
