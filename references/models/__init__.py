"""The models, one artifact class a file: each file defines ``models(scene)``."""
