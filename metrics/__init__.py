"""The judge: from pictures and predictions to a Verdict with its Findings."""
