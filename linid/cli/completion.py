"""The command `completion`."""

from __future__ import annotations

import click

from linid.cli.options import debug_option


@click.command()
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
@debug_option
def completion(shell: str) -> None:
    """Print the completion script of a shell.

    \b
    Examples:
      eval "$(linid completion bash)"        (in ~/.bashrc)
      linid completion fish > ~/.config/fish/completions/linid.fish
    """
    from click.shell_completion import get_completion_class

    found = get_completion_class(shell)
    assert found is not None
    click.echo(found(click.get_current_context().find_root().command, {}, "linid", "_LINID_COMPLETE").source())
