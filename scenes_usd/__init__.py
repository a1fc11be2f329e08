"""The corpus: canonical scenes as OpenUSD stages, and the reader that turns one into a Scene."""
