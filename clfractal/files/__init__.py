"""Files: arrays and a header to and from one format each."""
