"""The gallery: a static site over the reference corpus and any number of runs, down to the float pixel."""
