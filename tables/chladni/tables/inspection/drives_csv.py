"""Every drive of a table as CSV, for other programs."""

from __future__ import annotations

import csv
import io

import numpy as np

from chladni.tables.table import Table

COLUMNS = ("frequency_hz", "region", "x_mm", "y_mm", "channel", "gain", "phase_deg")


def drives_as_csv(table: Table) -> bytes:
    """A row per frequency, region and channel, below a header of `COLUMNS`.

    Raises
    ------
    InputError
        The table has no drives.
    """
    table.section()
    buffer = io.StringIO(newline="")
    writer = csv.writer(buffer)
    writer.writerow(COLUMNS)
    for section in table.sections:
        for region, drive in enumerate(table.drives(section)):
            x, y = table.grid.centre_mm(region)
            for channel, c in enumerate(drive):
                gain, phase = abs(c), float(np.degrees(np.angle(c)))
                writer.writerow(
                    [
                        f"{section.frequency_hz:g}",
                        region,
                        f"{x:.4f}",
                        f"{y:.4f}",
                        channel,
                        f"{gain:.6g}",
                        f"{phase:.4f}",
                    ]
                )
    return buffer.getvalue().encode()
