"""`python -m linid`: the command line."""

from linid.cli.main import main

if __name__ == "__main__":
    main()
