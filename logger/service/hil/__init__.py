"""Hardware in the loop: a recorded drive through real wires, and its log held against a replay."""
