"""What a shell offers after a tab: scenes and renderers, read from files alone so that it comes at once."""

from __future__ import annotations


def scenes(incomplete: str) -> list[tuple[str, str]]:
    """The classes and scenes that begin so, each with its claim."""
    from notabug.scenes_usd import catalogue

    found = [(entry.id, entry.claim) for entry in catalogue.scenes()]
    classes = dict.fromkeys(name.partition("/")[0] for name, _ in found)
    offered = [(name, f"all scenes of {name}") for name in classes] + found
    return [(name, claim) for name, claim in offered if name.startswith(incomplete)]


def renderers(incomplete: str) -> list[str]:
    """The renderers that begin so, those of notabug.toml included."""
    from notabug.adapters.registry import adapters

    return [name for name in adapters() if name.startswith(incomplete)]
