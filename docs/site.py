"""The documentation as a site: `make docs` writes it to service/http/web/site, where the service finds it.

docs/README.md arranges it: a heading is a part of the site, a link in the list below it a page of that part. Zensical
builds the pages and refuses links that lead nowhere. Its inline scripts become files, as the service's policy allows
none; of the one style that its search makes, the policy needs the hash, which stands in a file of the site.
"""

from __future__ import annotations

import ast
import base64
import hashlib
import json
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).resolve().parents[1]
TARGET: Final = ROOT / "service" / "http" / "web" / "site"
#: Pages beside docs/; in the site all lie in one folder.
BESIDE: Final = ("CHANGELOG.md", "CONTRIBUTING.md")
_DECISIONS: Final = "adr/README.md"
_LOGO: Final = ROOT / "service" / "http" / "web" / "static" / "sprag.svg"
_SCRIPT: Final = re.compile(r"<script>(.+?)</script>", re.DOTALL)
#: The search puts a style of its own, a variable of the script, beside its elements.
_STYLE: Final = re.compile(r'"style",\{\},(\w+)\.toString\(\)')
#: The file of the site that has the hash of that style, as a policy names it.
STYLE_HASH: Final = "style-hash.txt"
_SETTINGS: Final = """[project]
site_name = "Sprag"
site_description = "Parameter studies of vibration drives and machine shafts"
docs_dir = "pages"
site_dir = "site"
use_directory_urls = false
nav = [{nav}]

[project.extra]
generator = false

[project.theme]
font = false
logo = "sprag.svg"
favicon = "sprag.svg"
features = ["navigation.tabs", "navigation.top", "search.highlight", "toc.follow"]

[[project.theme.palette]]
media = "(prefers-color-scheme: light)"
scheme = "default"
toggle = {{ icon = "lucide/sun", name = "Dark colours" }}

[[project.theme.palette]]
media = "(prefers-color-scheme: dark)"
scheme = "slate"
toggle = {{ icon = "lucide/moon", name = "Light colours" }}
"""


def parts() -> dict[str, dict[str, str]]:
    """The parts of the site: pages (as paths below docs/, or beside it) with their titles."""
    found: dict[str, dict[str, str]] = {}
    for line in (ROOT / "docs" / "README.md").read_text("utf-8").splitlines():
        if line.startswith("## "):
            part = found.setdefault(line[3:], {})
        elif item := re.match(r"- \[(.+?)\]\((.+?)\)", line):
            part[item[2].removeprefix("../")] = item[1]
    return found


def _nav() -> str:
    return ", ".join(
        [
            _entry("Home", "README.md"),
            *(
                f"{{ {json.dumps(part)} = [{', '.join(_entry(title, page) for page, title in pages.items())}] }}"
                for part, pages in parts().items()
            ),
        ]
    )


def _entry(title: str, page: str) -> str:
    if page != _DECISIONS:
        return f"{{ {json.dumps(title)} = {json.dumps(page)} }}"
    files = sorted((ROOT / "docs" / "adr").glob("[0-9]*.md"))
    decisions = [
        _entry(file.read_text("utf-8").partition("\n")[0].removeprefix("# "), f"adr/{file.name}") for file in files
    ]
    return f"{{ {json.dumps(title)} = [{', '.join([json.dumps(page), *decisions])}] }}"


def _gather(folder: Path) -> None:
    """Copy what the site shows to one folder, with links that lead there."""
    shutil.copytree(ROOT / "docs", folder, ignore=shutil.ignore_patterns("*.py", "man", "__pycache__"))
    shutil.copytree(ROOT / "examples", folder / "examples")
    shutil.copy(_LOGO, folder)
    for name in BESIDE:
        shutil.copy(ROOT / name, folder)
    for script in (folder / "examples").glob("*.py"):
        script.rename(f"{script}.txt")  # below service/ it would be a module
    for file in folder.rglob("*.md"):
        text = file.read_text("utf-8")
        text = text.replace("](docs/", "](").replace("](../../", "](../") if file.parent.name == "adr" else text
        text = text.replace("](docs/", "](") if file.name in BESIDE else text
        text = text.replace("](../", "](") if file.parent == folder else text
        text = text.replace("](adr/)", f"]({_DECISIONS})").replace("](examples/)", "](presets.md)")
        file.write_text(re.sub(r"(\]\(examples/\w+\.py)\)", r"\1.txt)", text), "utf-8")


def _without_inline_scripts(site: Path) -> None:
    """Move each inline script to a file, named by its content."""
    for page in site.rglob("*.html"):
        up = "../" * (len(page.relative_to(site).parts) - 1)

        def moved(match: re.Match[str], up: str = up) -> str:
            name = f"assets/javascripts/inline-{hashlib.sha256(match[1].encode()).hexdigest()[:16]}.js"
            (site / name).write_text(match[1], "utf-8")
            return f'<script src="{up}{name}"></script>'

        page.write_text(_SCRIPT.sub(moved, page.read_text("utf-8")), "utf-8")


def _note_style(site: Path) -> None:
    (script,) = (site / "assets" / "javascripts").glob("bundle.*.js")
    text = script.read_text("utf-8")
    names = _STYLE.findall(text)
    if len(names) != 1:
        raise SystemExit(f"{script.name} makes {len(names)} styles; docs/site.py knows of one")
    literal = re.search(rf"[ ,]{names[0]}=('(?:[^'\\\\]|\\\\.)*')", text)
    if literal is None:
        raise SystemExit(f"{script.name} has no text {names[0]}, the style of its search")
    digest = hashlib.sha256(ast.literal_eval(literal[1]).encode()).digest()
    (site / STYLE_HASH).write_text(f"'sha256-{base64.b64encode(digest).decode()}'", "utf-8")


def build(target: Path) -> None:
    """Build the site, which replaces the folder ``target``; CalledProcessError where a link leads nowhere."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        _gather(folder / "pages")
        (folder / "zensical.toml").write_text(_SETTINGS.format(nav=_nav()), "utf-8")
        command = [sys.executable, "-m", "zensical", "build", "--strict", "--config-file", folder / "zensical.toml"]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise SystemExit(done.stdout + done.stderr)
        _without_inline_scripts(folder / "site")
        _note_style(folder / "site")
        if target.exists():
            shutil.rmtree(target)
        shutil.move(folder / "site", target)


if __name__ == "__main__":
    build(TARGET)
    print(f"{TARGET.relative_to(ROOT)}: open /docs/site/ of a service")
