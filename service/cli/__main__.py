"""``python -m sprag_study.service.cli``: the same as ``sprag``, where the script is not on the path."""

from sprag_study.service.cli import main

if __name__ == "__main__":
    main()
