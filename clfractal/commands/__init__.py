"""The commands of the shell, one file each; what a command does not need is not imported for it."""
