"""Scenes for renderers that read no USD: one file a format, and ``scene.json`` with everything in plain numbers."""
