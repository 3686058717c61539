"""A device on a port gets a table and is touched: python examples/device.py PORT [OUT_DIR]."""

import sys
from pathlib import Path

from matplotlib.figure import Figure

from chladni.host import Device, SerialWire
from chladni.host.figures import save
from chladni.sim import ChladniError, load_board
from chladni.tables import build_table


def main(port: str, out: Path) -> None:
    """Write the table of `strip5`, hold a finger on the board for a second, draw the heat."""
    with Device(SerialWire(port)) as device:
        print(device.flash(build_table(load_board("strip5"))[0]))
        device.touch(0.0, 6.0)
        answers = [device.info()]
        while len(answers) < 20:
            device.link.wait(0.05)
            answers.append(device.info())
        print(f"{answers[-1]['state']}; played {device.lift():.2f} s")
    axes = (figure := Figure(figsize=(6.0, 3.5), layout="constrained")).subplots()
    axes.plot([a["uptime_ms"] / 1e3 for a in answers], [a["coil_rise_k"] for a in answers])
    axes.set(xlabel="since power-on / s", ylabel="above the room / K")
    axes.legend([f"coil {k}" for k in range(answers[0]["channels"])])
    save(figure, out / "example-device.png")


if __name__ == "__main__":
    folder = Path(sys.argv[2] if len(sys.argv) > 2 else "out")
    folder.mkdir(parents=True, exist_ok=True)
    try:
        main(sys.argv[1] if len(sys.argv) > 1 else "no port given", folder)
    except ChladniError as error:
        print(error, file=sys.stderr)
        sys.exit(2)
