"""People at the controls: keys and gamepads, taking over from a policy, and the cockpit in a terminal."""
