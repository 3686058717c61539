"""Commands about a board as such: what it is, how well it focuses, and how it is made."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer

from chladni.drives.methods import SEED
from chladni.drives.objectives import default_objective
from chladni.drives.problem.problem import solved_board
from chladni.drives.problem.region_grid import region_grid
from chladni.drives.scoring.board_score import half_wavelength_mm
from chladni.drives.scoring.sensitivity import PLACES, sensitivity
from chladni.drives.scoring.several_fingers.fingers_sensitivity import fingers_sensitivity
from chladni.drives.scoring.small_amplitude import soft_wave
from chladni.host.cli.board_score import board_score
from chladni.host.cli.common.board_reports import (
    actuator_rows,
    foundation_report,
    measured_rows,
    panel_report,
    say_current,
    say_leftovers,
    say_panel,
    say_softening,
    say_vent,
    winding_report,
)
from chladni.host.cli.common.command_group import CommandGroup
from chladni.host.cli.common.drive_options import on_less
from chladni.host.cli.common.finger_remarks import (
    say_long_panel,
    say_mirrored,
    say_waves,
    say_worse,
)
from chladni.host.cli.common.options import (
    BoardArgument,
    FigureOption,
    JsonOption,
    LargeOption,
    SeedOption,
    check_figure,
)
from chladni.host.cli.common.output import (
    answer,
    check_output,
    progress_bar,
    say,
    say_unmet,
    write_figure,
)
from chladni.host.cli.common.tolerance_verdicts import of_tolerances
from chladni.host.cli.measured.refit import board_refit
from chladni.host.manufacture.board_parts import (
    board_parts,
    feet_of,
    foam_of,
    moving_mass_g,
    sheet_of,
)
from chladni.host.manufacture.drawing import board_drawing
from chladni.host.manufacture.drawing_files import FORMATS, save_drawing
from chladni.host.manufacture.prices import price_list
from chladni.host.manufacture.wiring.channels import channels
from chladni.host.manufacture.wiring.parts import parts_list
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board, shipped_boards
from chladni.sim.board.gpio import CHIPS
from chladni.sim.board.panel_layer import layered_plate
from chladni.sim.board.quantity import MM
from chladni.sim.fields.board_plate import plate_model
from chladni.sim.fields.magnet_softening import magnet_softening

board_app = typer.Typer(
    cls=CommandGroup, no_args_is_help=True, help="Inspect, score and draw boards."
)


def register(app: typer.Typer) -> None:
    """Add the commands."""
    app.add_typer(board_app, name="board")


@board_app.command("show")
def board_show(
    board: BoardArgument, large: LargeOption = False, as_json: JsonOption = False
) -> None:
    """Show a board and its first ten natural frequencies."""
    loaded = load_board(board)
    model = plate_model(loaded)
    modes, half = model.natural_frequencies(10), half_wavelength_mm(loaded)
    result: dict[str, Any] = {
        "name": loaded.name,
        "size_mm": [side / MM for side in loaded.plate.size],
        "sheet": sheet_of(loaded.plate),
        "actuators": actuator_rows(loaded),
        "modes_hz": [round(float(mode), 4) for mode in modes],
        "wavelength_mm": None if half is None else 2.0 * half,
        "fingerprint": f"{loaded.fingerprint():#018x}",
    }
    if loaded.measured:
        result["measured_by"] = f"{loaded.measured.by}, {loaded.measured.date}"
        result["measured"] = measured_rows(loaded.measured, as_json=as_json)
        say_worse(loaded)
        for key in ("before", "after"):
            if isolation := getattr(loaded.measured, key):
                result[f"measured_{key}"] = asdict(isolation)
    if loaded.foundation:
        foam = foam_of(loaded.foundation)
        named = {"foam": foam} if foam else {}
        result["foundation"] = named | foundation_report(loaded)
        say_vent(loaded)
    if loaded.springs:
        result["feet"] = feet_of(loaded.springs)
    layered, wave = layered_plate(loaded), soft_wave(loaded)
    if layered:
        result["panel"] = panel_report(layered) | _sensed(loaded)
        say_panel(layered, for_several=loaded.is_for_several)
    if wave:
        result["coil_current"] = asdict(wave)
        say_current(wave)
    if loaded.fingers is not None:
        say_waves(loaded, modes.tolist())
        say_mirrored(loaded)
    if loaded.coil is not None and not loaded.electronics.pwm_pins:
        chip, count = loaded.electronics.chip, len(loaded.actuators)
        most = CHIPS[chip].channels
        few = f", and {chip} has PWM for {most} of these {count}" if count > most else ""
        say(f"no electronics.pwm_pins: a device needs a GPIO for each coil{few} (docs/hardware.md)")
    if board not in shipped_boards():  # in those, what stands is meant
        _say_of_own(loaded, modes.tolist())
    if loaded.winding:
        result["winding"] = winding_report(loaded)
    softening = magnet_softening(loaded, model)
    if softening:
        result["neighbours"] = asdict(softening)
        say_softening(softening)
    answer(result, as_json=as_json, title=f"Board {loaded.name}")


board_app.command("score")(board_score)


CHANGES = {"level_db": "level_change_db", "isolation_db": "isolation_change_db"}
"""What people read of a parameter; elsewhere the same keys are of one board."""


@board_app.command("sensitivity")
def board_sensitivity(
    board: BoardArgument,
    figure: FigureOption = None,
    seed: SeedOption = SEED,
    large: LargeOption = False,
    as_json: JsonOption = False,
) -> None:
    """Show what each part's tolerance does to the focus, or with [fingers] to what two get."""
    check_figure(figure)
    loaded = load_board(board)
    loaded = on_less(loaded) if default_objective(loaded) == "focus" else loaded
    started = time.perf_counter()
    with progress_bar("boards") as progress:
        of_parts = sensitivity if loaded.fingers is None else fingers_sensitivity
        influences = of_parts(loaded, seed=seed, progress=progress)
    fields = solved_board(loaded).fields
    say_unmet(fields.error_estimate, fields.tolerance)
    verdict = of_tolerances(influences, None if loaded.measured else board)
    if figure is not None:
        from chladni.host.figures.boards import sensitivity_figure  # noqa: PLC0415

        write_figure(sensitivity_figure(loaded.name, influences, verdict), figure)
    # Of one finger or of several: each has numbers that the other has not.
    rows = [{k: v for k, v in asdict(one).items() if v is not None} for one in influences]
    result = {
        "verdict": verdict,
        "name": loaded.name,
        "places": min(PLACES, region_grid(loaded).count),
        "error_estimate": fields.error_estimate,
        "tolerance_met": fields.tolerance_met,
        "parameters": rows,
        "seconds": time.perf_counter() - started,
    }
    if not as_json:
        result["parameters"] = [{CHANGES.get(k, k): v for k, v in row.items()} for row in rows]
    answer(result, as_json=as_json, title=f"{loaded.name}: parts within their tolerances")


@board_app.command("wiring")
def board_wiring(
    board: BoardArgument,
    output: Annotated[
        Path, typer.Option("-o", "--output", help="Drawing to write (.svg, .png, .pdf).")
    ],
    as_json: JsonOption = False,
) -> None:
    """Draw how a board is wired, and list its parts with their values."""
    from chladni.host.figures.fields import save  # noqa: PLC0415
    from chladni.host.manufacture.wiring.figure import wiring_figure  # noqa: PLC0415

    check_output(output, "-o", (".png", ".pdf", ".svg"))
    loaded = load_board(board)
    save(wiring_figure(loaded), output)
    result = {
        "path": str(output),
        "channels": [
            {
                key: value
                for key, value in asdict(channel).items()
                if key != "sign_gpio" or loaded.electronics.is_bridge
            }
            for channel in channels(loaded)
        ],
        "parts": [
            {key: value for key, value in asdict(part).items() if key != "mass_g"}
            for part in parts_list(loaded)
        ],
    }
    answer(result, as_json=as_json, title=f"{loaded.name}: wiring")


def _say_of_own(board: Board, modes_hz: list[float]) -> None:
    """Remarks on a board of one's own."""
    say_leftovers(board, modes_hz)
    say_long_panel(board)


@board_app.command("drawing")
def board_drawing_command(
    board: BoardArgument,
    output: Annotated[Path, typer.Option("-o", "--output", help="Drawing to write (.svg, .dxf).")],
    as_json: JsonOption = False,
) -> None:
    """Draw a board for manufacture, 1:1 in mm, a layer for each part, and list its holes."""
    check_output(output, "-o", tuple(FORMATS))
    loaded = load_board(board)
    drawing = board_drawing(loaded)
    save_drawing(drawing, output)
    result = {
        "path": str(output),
        "layers": list(dict.fromkeys(shape.layer for shape in drawing.shapes)),
        "notes": list(drawing.notes) if as_json else "; ".join(drawing.notes),
        "holes": [asdict(hole) for hole in drawing.holes],
    }
    answer(result, as_json=as_json, title=f"{loaded.name}: drawing")


@board_app.command("parts")
def board_parts_command(board: BoardArgument, as_json: JsonOption = False) -> None:
    """List all parts of a board: what is cut, glued, screwed and wired, with masses and prices."""
    loaded = load_board(board)
    listed, prices = board_parts(loaded), price_list()
    low, high = prices.total(listed)
    parts = []
    for part in listed:
        price = prices.find(part)
        entry = asdict(part) | {
            "price_usd": list(price.of(part.count)) if price else None,
            "sold_by": prices.sold_by(part),
        }
        if not as_json:  # for people without what a value follows from, as `board wiring` has it
            told = _price_text(*price.of(part.count)) if price else "not counted, in no list"
            entry["price of all"] = told
            entry = {k: v for k, v in entry.items() if k != "why" and v is not None}
        parts.append(entry)
    without = {part.part: prices.sold_by(part) for part in listed if not prices.find(part)}
    result = {
        "verdict": _of_prices(low, high, without),
        "name": loaded.name,
        "moving_mass_g": moving_mass_g(loaded),
        "price_usd": [low, high],
        "prices_checked": prices.checked.isoformat(),
        "parts": parts,
    }
    answer(result, as_json=as_json, title=f"{loaded.name}: parts")


def _sensed(board: Board) -> dict[str, Any]:
    """From where to where a panel senses fingers, which may be beside the plate or less of it."""
    if board.panel is None:
        return {}
    spans = [[round(end / MM, 2) for end in ends] for ends in board.panel.area]
    return {"senses_x_mm": spans[0], "senses_y_mm": spans[1]}


def _of_prices(low: float, high: float, without: Mapping[str, str | None]) -> str:
    """What a board's parts cost, by public lists; `without` has who sells those of no list."""
    unknown = "".join(
        f"{name} (no list has it{f'; sold by {sold_by}' if sold_by else ''}), "
        for name, sold_by in without.items()
    )
    return f"The parts cost {_price_text(low, high)}. Not counted: {unknown}shipping, glue, tools."


def _price_text(low: float, high: float) -> str:
    """A range of dollars for people: cents where they matter."""
    cents = 2 if high < 10.0 else 0
    return f"{low:.{cents}f} to {high:.{cents}f} US$"


board_app.command("refit")(board_refit)
