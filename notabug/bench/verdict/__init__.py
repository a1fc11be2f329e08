"""bench verdict: who judges the judge. Labelled pictures of known faults and limitations, judged by us and by peers."""
