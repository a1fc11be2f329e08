"""The in-house ray tracer: Numba kernels, one source for float32 and float64."""
