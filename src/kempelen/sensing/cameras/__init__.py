"""Drivers of cameras: each implements ``core.camera.Camera`` and is made to run in a process of its own."""
