"""`chladni studio`: a page on which a board vibrates where it is pressed."""

from __future__ import annotations

import os
import secrets
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from chladni.drives.methods import SEED
from chladni.drives.solve import check_request
from chladni.host.cli.common.drive_options import OwnObjectiveOption
from chladni.host.cli.common.options import JobsOption, JsonOption, LargeOption
from chladni.host.cli.common.output import answer, progress_bar
from chladni.host.cli.common.ranges import LONGEST_S, within
from chladni.host.protocol.network import make_key, read_key
from chladni.sim.board.file import load_board
from chladni.sim.errors import InputError
from chladni.sim.files import write_whole

if TYPE_CHECKING:
    from chladni.host.studio.boards.prepared import BoardChoice

PORT = 8160
TOKEN_BYTES = 16
HIGHEST_PORT = 65_535


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command("studio")(studio)


def studio(
    board: Annotated[
        str, typer.Argument(metavar="[BOARD]", help="Board file, or a shipped name.")
    ] = "prototype",
    objective: OwnObjectiveOption = None,
    port: Annotated[
        int, typer.Option(callback=within(0, HIGHEST_PORT), help="0 is any that is free.")
    ] = PORT,
    host: Annotated[
        str,
        typer.Option(
            help="Address of this machine to listen at. By default no other machine "
            "reaches the page. Machines of a network reach it if they know the address."
        ),
    ] = "127.0.0.1",
    key: Annotated[
        Path | None,
        typer.Option(
            help="File with the secret of the address; made if it is not there. By "
            "default the secret is new at each start, and open pages lose the studio."
        ),
    ] = None,
    seconds: Annotated[
        float | None,
        typer.Option(
            callback=within(0.0, LONGEST_S, "s", above=True),
            help="Serve for so long; until Ctrl-C by default.",
        ),
    ] = None,
    device: Annotated[
        list[str] | None,
        typer.Option(help="Serial port that a page may choose besides those of USB bridges."),
    ] = None,
    export: Annotated[
        Path | None,
        typer.Option(
            help="Write the page with this board into this folder, as one file that needs "
            "no server, and end."
        ),
    ] = None,
    jobs: JobsOption = None,
    large: LargeOption = False,
    as_json: JsonOption = False,
) -> None:
    """Serve a page to press a board on, played by the emulated firmware."""
    loaded = load_board(board)
    check_request("phasor", objective or "ssim", SEED, None, None)
    # What serves pages takes a moment to load, and no other command needs it.
    from chladni.host.studio.boards.prepared import BoardChoice, page_objective  # noqa: PLC0415

    choice = BoardChoice(loaded, objective or page_objective(loaded))
    if export is not None:
        _export(choice, export, jobs, as_json=as_json)
        return
    from chladni.host.studio.server import listen, serve  # noqa: PLC0415

    listening = listen(port, host)
    token = _token(key)
    url = "http://{}:{}/{}/".format(*listening.getsockname(), token)

    def say() -> None:
        if as_json:
            answer({"url": url, "board": loaded.name}, as_json=True)
        else:
            sys.stdout.write(f"{url}\n")
        sys.stdout.flush()

    serve(
        listening,
        token,
        choice,
        known_ports=device or (),
        jobs=jobs,
        seconds=seconds,
        begun=say,
    )


def _export(choice: BoardChoice, folder: Path, jobs: int | None, *, as_json: bool) -> None:
    """Write the page as a file."""
    if folder.exists() and not folder.is_dir():
        raise InputError("--export", str(folder), "a folder")
    if not folder.absolute().parent.is_dir():
        raise InputError("--export", str(folder), "a folder, there or to be made in one that is")
    from chladni.host.studio.boards.prepared import ReadyBoard  # noqa: PLC0415
    from chladni.host.studio.export import one_file  # noqa: PLC0415

    with progress_bar("solving") as progress:
        ready = ReadyBoard.of(choice, jobs=jobs, progress=progress)
    data = one_file(ready).encode("utf-8")
    folder.mkdir(exist_ok=True)
    path = folder / "index.html"
    write_whole(path, data)
    result = {"path": str(path), "bytes": len(data), "board": choice.board.name}
    answer(result, as_json=as_json, title="Studio in a file")


def _token(key: Path | None) -> str:
    """What the address begins with; a page needs it to use the studio."""
    if key is None:
        return secrets.token_urlsafe(TOKEN_BYTES)
    return (read_key(key) if os.path.lexists(key) else make_key(key)).hex()
