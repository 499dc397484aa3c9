"""Pictures of every page for the guide, taken in the system's Chromium from a service with the examples.

python -m docs.screenshots [--into docs/figures/pages]
"""

from __future__ import annotations

import argparse
import io
import json
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
from PIL import Image
from playwright.sync_api import Page, sync_playwright

ROOT = Path(__file__).resolve().parents[1]
EXAMPLES = ("one_pendulum.json", "two_pendulums.toml", "measured_clutch.json")
DESKTOP, TABLET = (1280, 900), (820, 1100)
#: Colours of a picture; pages have few.
COLOURS = 96
SECONDS = 600


@contextmanager
def service(folder: str) -> Iterator[str]:
    """A service of its own; its address."""
    database = str(Path(folder) / "pictures.sqlite3")
    command = [sys.executable, "-m", "sprag_study.service.cli", "serve", "--json", "--port", "0", "--db", database]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, cwd=ROOT) as process:
        assert process.stdout is not None
        try:
            yield json.loads(process.stdout.readline())["address"]
        finally:
            process.send_signal(signal.SIGTERM)


def submit(address: str) -> list[str]:
    """Run the examples; their ids."""
    ids = []
    with httpx.Client(base_url=f"{address}/api/v1", timeout=SECONDS) as client:
        for name in EXAMPLES:
            path = ROOT / "examples" / name
            kind = "toml" if path.suffix == ".toml" else "json"
            headers = {"Content-Type": f"application/{kind}"}
            answer = client.post("/studies", content=path.read_bytes(), headers=headers).raise_for_status()
            ids.append(str(answer.json()["id"]))
        limit = time.monotonic() + SECONDS
        while any(client.get(f"/studies/{study}").json()["state"] not in ("finished", "failed") for study in ids):
            assert time.monotonic() < limit
            time.sleep(0.3)
    return ids


def shots(ids: list[str]) -> list[tuple[str, str, tuple[int, int], bool]]:
    """Name, address, window and whether the whole page is shown."""
    one, two, fitted = ids
    mapped = f"/studies/{one}?x=shaft.load&up=excitation.frequency"
    return [
        ("studies", "/", DESKTOP, True),
        ("new", "/new?preset=one_pendulum", (1280, 1060), False),
        ("new-fit", f"/new?clone={fitted}", (1280, 1000), False),
        ("study", f"/studies/{one}", (1280, 1150), False),
        ("study-tablet", f"/studies/{two}", TABLET, False),
        ("curves", f"/studies/{one}?x=shaft.load&by=excitation.amplitude_x&y=shaft.speed.mean", DESKTOP, False),
        ("map", f"{mapped}&z=power.useful.mean&kind=contour", DESKTOP, False),
        ("map-order", f"{mapped}&z=regime.order", DESKTOP, False),
        ("explore", f"/studies/{one}/rows?max:shaft.load=0.15&sort=-efficiency", (1280, 1150), False),
        ("case", f"/studies/{two}/cases/45", DESKTOP, True),
        ("laboratory", "/new?model=machine-shaft&machine=press", (1280, 1000), False),
        ("laboratory-drive", "/new?shaft.load=0.2", (1280, 1000), False),
        ("schedules", "/nights/new", DESKTOP, True),
        ("compare", f"/compare?study={one}&study={two}&study={fitted}", DESKTOP, True),
    ]


def take(page: Page, name: str, whole: bool) -> bytes:
    """The picture of a page, once everything on it is drawn."""
    page.wait_for_load_state("networkidle")
    page.wait_for_function("() => !document.querySelector('[aria-busy], .stale, [data-later]')")
    if name == "new-fit":
        page.locator("details:has(.clutch)").evaluate_all("(all) => all.forEach((one) => { one.open = true; })")
    target = page.locator("div.clutch").first if name == "new-fit" else page
    options = {} if name == "new-fit" else {"full_page": whole}
    shot = Image.open(io.BytesIO(target.screenshot(animations="disabled", **options)))
    packed = io.BytesIO()
    shot.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE).save(packed, "PNG", optimize=True)
    return packed.getvalue()


def main() -> None:
    """Take every picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--into", type=Path, default=ROOT / "docs" / "figures" / "pages")
    folder: Path = parser.parse_args().into
    folder.mkdir(parents=True, exist_ok=True)
    names = ("chromium-headless-shell", "chromium", "google-chrome")
    chromium = next(filter(None, map(shutil.which, names)), None)
    options: dict[str, Any] = {"executable_path": chromium, "args": ["--no-sandbox"]}
    with tempfile.TemporaryDirectory() as work, service(work) as address, sync_playwright() as playwright:
        ids = submit(address)
        browser = playwright.chromium.launch(**options)
        for name, path, (width, height), whole in shots(ids):
            page = browser.new_page(viewport={"width": width, "height": height})
            page.set_default_timeout(SECONDS * 1e3)
            page.goto(address + path)
            content = take(page, name, whole)
            (folder / f"{name}.png").write_bytes(content)
            print(f"{name}.png {len(content) / 1e3:.0f} kB")
            page.close()
        browser.close()


if __name__ == "__main__":
    main()
