"""The command line. Exit status 0 done, 2 bad input (one line), 3 the numbers allow no answer."""

import sys
from collections.abc import Callable

import typer

from robocal.errors import BadInput, NoAnswer
from service.commands.backup import backup
from service.commands.basecal import basecal
from service.commands.compensate import compensate
from service.commands.convert import convert
from service.commands.copy_database import copy_database
from service.commands.demo import demo
from service.commands.diagnose import diagnose
from service.commands.emulate import emulate
from service.commands.export import export
from service.commands.identify import identify
from service.commands.key import key
from service.commands.plan import plan
from service.commands.predict import predict
from service.commands.reproduce import reproduce
from service.commands.restore import restore
from service.commands.serve import serve
from service.commands.station import station
from service.commands.uncertainty import uncertainty
from service.commands.user import user

COMMANDS: tuple[Callable[..., None], ...] = (
    identify,
    diagnose,
    predict,
    station,
    compensate,
    convert,
    export,
    uncertainty,
    plan,
    basecal,
    serve,
    backup,
    restore,
    copy_database,
    key,
    user,
    demo,
    emulate,
    reproduce,
)

app = typer.Typer(
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="Robot-cell calibration: identify what the robot really is, and say how sure it is.",
)
for command in COMMANDS:
    app.command()(command)


def main() -> None:
    """Run a command; turn errors on purpose into one line and an exit status."""
    try:
        # Without any argument typer prints the help, which it does as a program of its own.
        sys.exit(app(prog_name="robocal", standalone_mode=len(sys.argv) < 2))
    except typer.TyperException as error:
        said = error.format_message()
        # The next name by spelling would be export, the opposite.
        said = said.replace("'import'. Did you mean 'export'?", "'import'. It is called 'convert'.")
        _leave(f"robocal: {said}", error.exit_code)
    except typer.Abort:
        _leave("robocal: stopped", 1)
    except BadInput as error:
        _leave(f"robocal: {error}", 2)
    except NoAnswer as error:
        _leave(f"robocal: {error}", 3)


def _leave(sentence: str, status: int) -> None:
    sys.stderr.write(" ".join(sentence.split()) + "\n")
    sys.exit(status)
