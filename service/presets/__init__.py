"""Studies that come with the program: a demonstration, and a start for one's own."""

from importlib.resources import files

_FORMATS = (".json", ".toml")


def _files() -> dict[str, str]:
    return {
        item.name.rpartition(".")[0]: item.name for item in files(__name__).iterdir() if item.name.endswith(_FORMATS)
    }


def preset_names() -> tuple[str, ...]:
    """Names of the studies, in order."""
    return tuple(sorted(_files()))


def preset_text(name: str) -> tuple[str, str]:
    """File name and text of a study's spec; KeyError when there is none of that name."""
    file = _files()[name]
    return file, (files(__name__) / file).read_text(encoding="utf-8")
