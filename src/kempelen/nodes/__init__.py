"""Programs on several machines: robots, boards, cameras and engines that are found and used over a network.

A *node* stands beside its device and offers it at a *table*; whoever plays there is its *arbiter*. What goes
between them is in `messages`; how it travels is behind `link.Link`.
"""
