"""The commands, one file each, from what is asked to the exit code. ``command_line/`` says what can be typed."""
