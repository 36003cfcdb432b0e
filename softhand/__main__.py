"""`python -m softhand`: the command softhand."""

from softhand.commands.main import main

if __name__ == "__main__":
    main()
