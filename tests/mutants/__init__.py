"""Small mistakes put into the program on purpose, to see whether a test notices: `make mutate`."""
