"""The commands of the shell, one file each; each command imports only what it needs."""
