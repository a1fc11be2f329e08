"""What can be typed: each command with its arguments, options, help and example. ``commands/`` does what is asked.

Only typer is imported here: what a command needs is imported when it runs, so that help comes at once.
"""
