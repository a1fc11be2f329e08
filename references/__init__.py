"""The truth: in-house renderers and the models that predict what a renderer may legitimately draw."""
