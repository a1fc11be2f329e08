"""bench generality: random scenes, real meshes, injected faults and switched-on limitations, none of the corpus."""
