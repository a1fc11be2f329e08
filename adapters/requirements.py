"""Requirements: what a scene needs and an adapter has not is refused by name, before a renderer is started."""

from __future__ import annotations

from notabug.adapters.base import Adapter, UnsupportedError
from notabug.adapters.registry import needs
from notabug.scenes_usd.scene import Scene


def check_supported(adapter: Adapter, scene: Scene) -> None:
    """Raise UnsupportedError, naming each missing capability, where ``adapter`` cannot draw ``scene``."""
    missing = sorted(needs(scene) - adapter.capabilities)
    if missing:
        raise UnsupportedError(
            f"scene {scene.id!r} needs {', '.join(missing)}",
            where=f"adapter {adapter.name!r}",
            expected=f"only {', '.join(sorted(adapter.capabilities))}",
            do="choose another renderer for this scene",
        )
