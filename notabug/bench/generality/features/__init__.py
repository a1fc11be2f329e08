"""Random scenes of what design tools export: preview surfaces, lights with a size, subdivision, instances and more."""
