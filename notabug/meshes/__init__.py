"""Mesh files that are no scenes: read, cut into triangles where need be, and put into a scene of their own."""
