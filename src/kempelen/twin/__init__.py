"""The simulated world: physics, virtual controllers and the virtual person. A process of its own."""
