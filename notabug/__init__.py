"""notabug: is it a rendering bug, or really not?

Five floors, each using only the floors below it: ``notabug`` (front door), ``notabug.metrics`` (the judge),
``notabug.adapters`` (one renderer a file), ``notabug.references`` (the truth), ``notabug.scenes_usd`` (the corpus).
"""

__version__ = "0.1.0"
