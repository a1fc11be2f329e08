"""The renderers under test: one adapter a file, each turning a Scene into Renders."""
