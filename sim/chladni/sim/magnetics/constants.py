"""Constants of nature that magnetics needs."""

from __future__ import annotations

MU_0 = 1.25663706127e-6
"""Magnetic constant, N/A²: CODATA 2022, as in `scipy.constants`, which take 0.2 s to load."""
