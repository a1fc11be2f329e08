"""Authoring scripts: each writes one scene of the corpus; run again they write the same bytes."""
