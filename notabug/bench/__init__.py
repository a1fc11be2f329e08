"""Benchmarks: what notabug costs and how well it judges. Each prints its numbers and says what they are ratios of."""
