"""The workarounds: what the paper proposes against each artifact, as data, one artifact class a file."""
