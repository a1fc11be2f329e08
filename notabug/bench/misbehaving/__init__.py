"""A renderer that misbehaves as its scene is called: ``program.py`` is called, the others say what it does."""
