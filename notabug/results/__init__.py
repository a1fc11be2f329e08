"""What a run leaves: the record ``run.json``, what is expected of each result, the gate, and the words for people."""
