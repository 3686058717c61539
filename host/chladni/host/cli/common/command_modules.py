"""Which module has which command, so that a command loads its own and no other.

Nothing is imported here: `chladni` looks a command up before it loads anything.
"""

from __future__ import annotations

MODULES = {
    "field": "plate",
    "modes": "plate",
    "sweep": "plate",
    "solve": "solve",
    "emulate": "emulate",
    "studio": "studio",
    "compare": "compare",
    "fingers": "several_fingers.fingers",
    "effects": "effects.commands",
    "play": "effects.play",
    "design": "designing.design",
    "calibrate": "measured.calibrate",
    "flash": "device.commands",
    "board": "board",
    "table": "table",
    "device": "device.commands",
}
"""Below `chladni.host.cli`, by command, in the order in which `chladni -h` lists them. The module's
`register` adds the command to an app."""
