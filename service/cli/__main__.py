"""``python -m sprag.service.cli``: the same as ``sprag``, where the script is not on the path."""

from sprag.service.cli import main

if __name__ == "__main__":
    main()
