"""From exceptions to messages and exit codes: 0 done, 1 internal, 2 usage, 3 configuration, 4 bad data,
5 finished but not converged, 6 something has changed, 130 interrupted (Ctrl-C), 143 terminated (SIGTERM)."""

from __future__ import annotations

import errno
import json
from typing import Any

import click

from linid.errors import LinidError
from linid.stop_signals import exit_code_of


class Group(click.Group):
    """The command group that turns what a command raises into a message and an exit code."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """In the order of their use."""
        return list(self.commands)

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command; no traceback unless --debug."""
        try:
            return super().invoke(ctx)
        except LinidError as error:
            if ctx.meta.get("linid.debug"):
                raise
            _say(ctx, error.exit_code, f"error: {error.place}: {error.fact}", error.remedy)
        except KeyboardInterrupt as error:
            folder, code = getattr(error, "folder", None), exit_code_of(error)
            if folder is None:
                _say(ctx, code, "interrupted", "Nothing was saved.")
            else:
                _say(
                    ctx,
                    code,
                    f"interrupted; the state is saved in {folder}",
                    f"Go on with the same command and: --resume --out {folder}",
                )
        except (click.ClickException, click.exceptions.Exit, click.Abort):
            raise
        except OSError as error:
            if error.errno == errno.EPIPE or ctx.meta.get("linid.debug"):
                raise
            place = error.filename or "the operating system"
            _say(ctx, 1, f"error: {place}: {error.strerror}", "Check free space and permissions.")
        except Exception as error:
            if ctx.meta.get("linid.debug"):
                raise
            _say(
                ctx,
                1,
                f"internal error: {type(error).__name__}: {error}",
                "This is a fault of the program. Run the command again with --debug and report what it prints.",
            )
        return None


def _say(ctx: click.Context, code: int, fact: str, remedy: str) -> None:
    click.echo(fact.rstrip("."), err=True)
    if remedy:
        click.echo(f"  {remedy}", err=True)
    if ctx.meta.get("linid.json_output"):
        click.echo(json.dumps({"exit_code": code, "error": fact, "remedy": remedy}))
    ctx.exit(code)
