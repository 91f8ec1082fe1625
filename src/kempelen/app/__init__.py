"""The only place that wires things together: configuration in, a running table out."""
