"""The network that sees gestures: backbones, where their weights come from, how it is kept, and how it answers."""
