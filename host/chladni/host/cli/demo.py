"""`make demo`, as a process; what it does is in `whole_chain`."""

from __future__ import annotations

from chladni.host.cli.app import as_process


def main() -> int:
    """Run the demo; 0 done, 1 failed, 2 wrong input, 130 Ctrl-C."""
    from chladni.host.cli.whole_chain import main as demonstrate  # noqa: PLC0415

    return demonstrate()


if __name__ == "__main__":
    as_process(["chladni.host.cli.whole_chain"], main)
