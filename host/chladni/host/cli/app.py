"""The `chladni` command: thin over `chladni.sim`, `chladni.tables` and `chladni.host`."""

from __future__ import annotations

import sys
import time
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from chladni.drives.methods import SEED
from chladni.drives.scoring.scorecard import score
from chladni.drives.solve import Solution, check_request, solve
from chladni.host.cli import compare as compare_command
from chladni.host.cli import device as device_commands
from chladni.host.cli import plate as plate_commands
from chladni.host.cli import table as table_commands
from chladni.host.cli.options import (
    BoardArgument,
    FigureOption,
    JsonOption,
    MethodOption,
    ObjectiveOption,
    SeedOption,
    check_figure,
)  # fmt: skip
from chladni.host.cli.output import (
    answer,
    check_output,
    parse_place,
    progress_bar,
)  # fmt: skip
from chladni.host.device.virtual_port import Terminal
from chladni.host.emulation.emulator import LEVEL, Emulator, TouchEvent
from chladni.host.emulation.loop import board_of, run_loop
from chladni.host.figures.fields import save
from chladni.host.figures.solvers import trace_figure
from chladni.host.protocol import link as link_protocol
from chladni.host.protocol.network import DEFAULT_PORT, NetworkSettings, read_key
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.board.quantity import MM
from chladni.sim.errors import ChladniError, InputError
from chladni.sim.fields.transfer import plate_model
from chladni.sim.files import write_arrays
from chladni.tables import layout
from chladni.tables.format import read_table

app = typer.Typer(
    no_args_is_help=True, rich_markup_mode=None, pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)  # fmt: skip
board_app = typer.Typer(help="Look at board files.", no_args_is_help=True)
table_app = typer.Typer(help="Build and read drive tables.", no_args_is_help=True)
app.add_typer(board_app, name="board")
app.add_typer(table_app, name="table")

plate_commands.register(app)
compare_command.register(app)
table_commands.register(table_app)
device_commands.register(app)


@app.callback(invoke_without_command=True)
def versions(
    context: typer.Context,
    show: Annotated[
        bool, typer.Option("--version", help="Show the versions of program, tables and link.")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Put a vibration where a finger is."""
    if show:
        known = {
            "chladni": version("chladni"),
            "table_format": f"{layout.VERSION_MAJOR}.{layout.VERSION_MINOR}",
            "link": f"{link_protocol.VERSION_MAJOR}.{link_protocol.VERSION_MINOR}",
        }
        answer(known, as_json=as_json, title="Chladni")
        raise typer.Exit
    if context.invoked_subcommand is None:
        raise InputError("COMMAND", "nothing", "a command: `chladni -h` lists them")


@board_app.command("show")
def board_show(board: BoardArgument, as_json: JsonOption = False) -> None:
    """Show a board and its first ten natural frequencies."""
    loaded = load_board(board)
    modes = plate_model(loaded).natural_frequencies(10)
    result = {
        "name": loaded.name,
        "size_mm": [side / MM for side in loaded.plate.size],
        "actuators": [
            {"name": a.name, "at_mm": [round(value / MM, 9) for value in a.at]}
            for a in loaded.actuators
        ],
        "modes_hz": [round(float(mode), 4) for mode in modes],
        "wavelength_mm": loaded.plate.wavelength(loaded.drive.frequency_hz) / MM,
        "fingerprint": f"{loaded.fingerprint():#018x}",
    }
    answer(result, as_json=as_json, title=f"Board {loaded.name}")


@app.command("solve")
def solve_command(
    board: BoardArgument,
    target: Annotated[str, typer.Option(help="Where the vibration shall be: X,Y (mm).")],
    method: MethodOption = "phasor",
    objective: ObjectiveOption = "ssim",
    seed: SeedOption = SEED,
    steps: Annotated[int | None, typer.Option(help="Steps, in place of the method's own.")] = None,
    trace: Annotated[
        Path | None,
        typer.Option(help="Keep an annealing's course here (.npz), and go on from it."),
    ] = None,
    figure: FigureOption = None,
    as_json: JsonOption = False,
) -> None:
    """Find the drive that best focuses the vibration at one place, and score it."""
    place = parse_place(target, "--target")
    check_request(method, objective, seed, steps, trace)
    if trace is not None:
        check_output(trace, "--trace")
    check_figure(figure)
    if figure is not None and trace is None:
        raise InputError("--figure", str(figure), "--trace beside it, for it draws the trace")
    loaded = load_board(board)
    with progress_bar(method) as progress:
        solution = solve(
            loaded, place, method=method, objective=objective, seed=seed, steps=steps,
            trace=trace, progress=progress,
        )  # fmt: skip
    if figure is not None and trace is not None:
        save(trace_figure(trace, solution), figure)
    report = solution_report(loaded, solution)
    if not report["movable"]:
        sys.stderr.write(f"chladni: no drive of these actuators moves {target} mm\n")
    answer(report, as_json=as_json, title=f"{loaded.name}: focus at {target} mm")


def solution_report(board: Board, solution: Solution) -> dict[str, Any]:
    """A solution and its scorecard as `chladni solve --json` answers."""
    card = asdict(score(solution, board))
    baselines = card.pop("nulls")
    return {
        "target_mm": list(solution.target_mm),
        "method": solution.method,
        "objective": solution.objective,
        "drive": drive_entries(board, solution.drive),
        **card,
        "seconds": solution.seconds,
        "evaluations": solution.evaluations,
        "details": {
            name: value if np.isfinite(value) else None for name, value in solution.details.items()
        },
        "baselines": baselines,
    }


def drive_entries(
    board: Board, drive: np.ndarray[Any, np.dtype[np.complex128]]
) -> list[dict[str, Any]]:
    """A drive for people: name, gain and phase of every actuator."""
    return [
        {
            "actuator": actuator.name,
            "gain": float(abs(value)),
            "phase_deg": float(np.degrees(np.angle(value))),
        }
        for actuator, value in zip(board.actuators, drive, strict=True)
    ]


@app.command()
def emulate(
    table: Annotated[Path, typer.Argument(metavar="TABLE", help="Table file (.chl).")],
    touch: Annotated[
        list[str] | None, typer.Option(help="Touch X,Y@MS: place in mm, time in ms.")
    ] = None,
    ms: Annotated[float | None, typer.Option("--ms", help="How long to run, ms.")] = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Recording to write (.npz).")
    ] = None,
    serial: Annotated[
        bool, typer.Option("--serial", help="Offer the device on a pseudo-terminal instead.")
    ] = False,
    key: Annotated[
        Path | None, typer.Option(help="With --serial: on UDP too, at 127.0.0.1, under this key.")
    ] = None,
    udp_port: Annotated[int, typer.Option(help="Where, with --key.")] = DEFAULT_PORT,
    lift: Annotated[list[float] | None, typer.Option(help="Lift the finger at MS.")] = None,
    board: Annotated[str | None, typer.Option(help="The table's board, if not shipped.")] = None,
    level: Annotated[float, typer.Option(help="Share of full amplitude, 0 to 1.")] = LEVEL,
    frequency: Annotated[
        float | None, typer.Option(help="Play the table's drives of this frequency, Hz.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Run the firmware on touches, record its pins, and score the field they make."""
    if not 0.0 < level <= 1.0:
        raise InputError("--level", level, "a share of full amplitude from 0 to 1")
    if key is not None and not serial:
        raise InputError("--key", str(key), "--serial with it")
    if serial:
        for option, given in (("--touch", touch), ("--lift", lift), ("-o", output)):
            if given:
                raise InputError(option, given, "nothing with --serial, which serves a device")
        network = None
        if key is not None:
            network = NetworkSettings("emulated", "", read_key(key), udp_port)
        _serve(table, board, ms, level, network, as_json=as_json)
        return
    loaded = read_table(table)
    for option, value, expected in (
        ("--touch", touch, "X,Y@MS: a place in mm and a time in ms"),
        ("--ms", ms, "how long to run, ms"), ("-o", output, "a file to write (.npz)"),
    ):  # fmt: skip
        if value is None:
            raise InputError(option, "nothing", expected)
    assert touch is not None
    assert ms is not None
    assert output is not None
    check_output(output, "-o")
    events = [_parse_touch(text) for text in touch] + [TouchEvent(at, None) for at in lift or []]
    owner = board_of(loaded, board, file=str(table))
    recording, report = run_loop(loaded, owner, events, ms, level=level, frequency_hz=frequency)
    write_arrays(output, t_s=recording.t_s, duty=recording.duty, carrier_hz=recording.carrier_hz)
    result = {
        "latency_ms": report.latency_ms,
        "channels": [
            {"actuator": actuator.name, **asdict(channel)}
            for actuator, channel in zip(owner.actuators, report.channels, strict=True)
        ],
        "region": report.region,
        "target_mm": list(report.target_mm),
        "ssim": report.ssim,
        "ssim_table": report.ssim_table,
        "path": str(output),
    }
    answer(result, as_json=as_json, title=f"{table} on the emulated board")


def _serve(
    table: Path, board: str | None, ms: float | None, level: float,
    network: NetworkSettings | None, *, as_json: bool,
) -> None:  # fmt: skip
    """Offer the emulated device on a pseudo-terminal, for ever or for so long."""
    if ms is not None and not 0.0 < ms < np.inf:
        raise InputError("--ms", ms, "more than 0")
    loaded = read_table(table)
    owner = board_of(loaded, board, file=str(table))
    emulator = Emulator(owner, loaded, level=level, network=network)
    terminal = Terminal(emulator)
    # A port that is announced is there.
    terminal.network.follow()
    if as_json:
        answer({"port": terminal.port, "udp_port": emulator.core.network_port}, as_json=True)
    else:
        sys.stdout.write(terminal.port + "\n")
    sys.stdout.flush()
    end = None if ms is None else time.monotonic() + ms / 1e3
    try:
        terminal.serve(lambda: end is not None and time.monotonic() > end)
    except KeyboardInterrupt:
        pass
    finally:
        terminal.close()


def _parse_touch(text: str) -> TouchEvent:
    place, mark, at = text.partition("@")
    try:
        at_ms = float(at)
    except ValueError:
        at_ms = float("nan")
    if not mark or not np.isfinite(at_ms):
        raise InputError("--touch", text, "X,Y@MS: a place in mm and a time in ms")
    return TouchEvent(at_ms, parse_place(place, "--touch"))


def main() -> None:
    """Run the command line; 0 done, 1 the work failed, 2 the input is wrong."""
    try:
        app(prog_name="chladni")
    except InputError as error:
        sys.exit(_complain(str(error), 2))
    except ChladniError as error:
        sys.exit(_complain(str(error), 1))
    except OSError as error:
        sys.exit(_complain(f"{error.filename or 'output'}: {error.strerror}", 1))


def _complain(message: str, code: int) -> int:
    sys.stderr.write(f"chladni: {message}\n")
    return code


if __name__ == "__main__":
    main()
