"""Pictures of chess sets that nobody made: what the piece classifier learns from and is measured on."""
