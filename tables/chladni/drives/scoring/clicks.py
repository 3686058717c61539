"""What a click keeps, reckoned from one frequency in place of over time."""

CLICK_HZ = 200.0
"""What a click keeps is what its real gains, found at the board's own frequency, keep here.

Of two fingers on 22 boards on feet and on foam medians and worst tenths are within 2 dB of clicks
over time on the same plates where the first mode lies at 250 Hz or above. Below that they are
within 4, and a tone of 160 Hz keeps up to 17 dB more than a click
(bench/several_fingers/clicks.py). Beside one finger that has rested they are 0.6 to 2 dB above
clicks over time (`strip5`, `quiet5`, `pad16` and a pad of nine coils on steel)."""
CLICK_PEAK = 0.89
"""Largest sample of the shipped click behind its low-pass."""
