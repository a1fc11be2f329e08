"""The in-house z-buffer rasteriser: a depth buffer's own artifacts, and no shadows but those of a shadow map."""
