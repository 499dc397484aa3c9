"""Every page, in English on a desktop and in Ukrainian on a phone: axe-core finds nothing, and the page fits."""

from __future__ import annotations

import json
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING, Any, Final

from axe_playwright_python.base import AXE_SCRIPT

from sprag_study.service.http.roles import ROLES
from sprag_study.service.jobs.scheduler import Scheduler
from sprag_study.service.presets import preset_text
from sprag_study.service.schedules.fields import read_fields
from sprag_study.service.spec.document import load_spec
from tests.service.calibrating import calibration
from tests.service.http.web.fields import named
from tests.service.searching import search
from tests.service.timed_spec import SPEC

if TYPE_CHECKING:
    from collections.abc import Callable

    from playwright.sync_api import Page

    from tests.service.conftest import Service

DESKTOP: Final = {"width": 1280, "height": 900}
PHONE: Final = {"width": 390, "height": 800}
TABLET: Final = {"width": 820, "height": 1180}
DRAWN: Final = "() => [...document.querySelectorAll('[data-figure]')].every((plot) => plot.dataset.drawn)"
#: Of siblings that are alike two stay, as axe would find the same in all: rows of a table, options, points of a figure;
#: of the operations of the interface, which one macro writes, five. With ``once``, what an earlier page of the tab had
#: in the same place goes too. Elements are alike if what they contain is alike, with the same attributes; of texts only
#: that there is one counts, of references that they lead somewhere. What could be scrolled still can.
#: Gives the ids that the page has twice.
SHORTER: Final = """(once) => {
  const texts = new Set(("id name value title alt href src srcset action formaction content datetime style width "
    + "height x y x1 x2 y1 y2 dx dy cx cy r rx ry d points transform viewBox aria-label min max step placeholder"
  ).split(" "));
  const references = new Set(["for", "list", "form", "aria-labelledby", "aria-describedby", "aria-controls"]);
  const removable = new Set(["TR", "LI", "OPTION", "DIV", "DETAILS", "P", "DT", "DD", "SECTION", "ARTICLE", "FIELDSET",
    "HEADER", "NAV", "FOOTER"]);
  const ids = [...document.querySelectorAll("[id]")].map((e) => e.id), known = new Set(ids);
  const kept = JSON.parse(sessionStorage.getItem("shapes") ?? "[[], []]");
  const numbers = new Map(kept[0]), before = new Set(kept[1]), places = new Set(kept[1]);
  const value = (a) => texts.has(a.name) || a.name.startsWith("data-") ? a.value !== ""
    : references.has(a.name) ? a.value.split(" ").every((id) => known.has(id)) : a.value;
  const numbered = (...parts) => {
    const told = parts.join("|");
    if (!numbers.has(told)) numbers.set(told, numbers.size);
    return numbers.get(told);
  };
  const shape = (e, above) => {
    const outside = numbered(above, e.tagName, ...[...e.attributes].map((a) => `${a.name}=${value(a)}`));
    const counts = new Map(), inside = [];
    for (const child of [...e.childNodes]) {
      if (child.nodeType === Node.TEXT_NODE && child.data.trim() !== "") inside.push("text");
      if (child.nodeType !== Node.ELEMENT_NODE) continue;
      const number = shape(child, outside), count = (counts.get(number) ?? 0) + 1;
      counts.set(number, count);
      if (count <= 2) inside.push(number);
      const alike = count > 2 || (once && before.has(number));
      if (alike && (removable.has(child.tagName) || child.ownerSVGElement)) child.remove();
    }
    const number = numbered(outside, "", ...inside);
    places.add(number);
    return number;
  };
  const scrolled = [...document.querySelectorAll("main *")].filter((e) => e.clientHeight > 0
    && (e.scrollHeight > e.clientHeight || e.scrollWidth > e.clientWidth) && getComputedStyle(e).overflow !== "visible"
  ).map((e) => [e, e.scrollHeight, e.scrollWidth]);
  [...document.querySelectorAll(".operation")].slice(5).forEach((one) => one.remove());
  shape(document.body, "");
  for (const [e, height, width] of scrolled) {
    Object.assign(e.firstElementChild?.style ?? {}, { minHeight: `${height}px`, minWidth: `${width}px` });
  }
  if (once) sessionStorage.setItem("shapes", JSON.stringify([[...numbers], [...places]]));
  return ids.filter((id, at) => known.size < ids.length && ids.indexOf(id) !== at);
}"""
#: Each finding of axe, without what it says about all that is right.
FINDINGS: Final = """(options) => axe.run(document, options).then(({ violations }) =>
  violations.flatMap(({ id, nodes }) => nodes.map(({ html }) => `${id}: ${html.slice(0, 200)}`)))"""
#: Rules whose findings depend on colours, on the width and on the language.
NARROW: Final = [
    "color-contrast", "link-in-text-block", "scrollable-region-focusable", "target-size",
    "html-has-lang", "html-lang-valid", "valid-lang", "label", "button-name", "link-name",
]  # fmt: skip
#: A name of customers that cannot be broken at blanks.
LONG: Final = "Zuführung_der_Linie_7_mit_weicher_Freilaufkupplung_und_großem_Schwungrad"
#: What is beside the screen: how far, and the innermost element that is; "" where nothing is.
BEYOND: Final = """() => {
  const over = document.documentElement.scrollWidth - innerWidth;
  if (over <= 0) return "";
  const wide = [...document.querySelectorAll("main *")].filter((e) => e.getBoundingClientRect().right > innerWidth + 1
    && !e.closest(".scroll, pre, dialog"));
  return `${over} px: ${wide.slice(-3).map((e) => e.outerHTML.slice(0, 160)).join(" | ")}`;
}"""
#: Addresses of every kind of page, by its route; `{STUDY}` and the like are ids.
PAGES: Final[dict[str, list[str]]] = {
    "/": ["/", "/?archived=true", "/?deleted=true", "/?search=nothing"],
    "/login": ["/login"],
    "/new": [
        "/new", "/new?preset=two_pendulums", "/new?preset=press", "/new?preset=tolerances",
        "/new?preset=fastest_drive", "/new?preset=one_pendulum&mode=text",
    ],
    "/parts": ["/parts"],
    "/me/workers": ["/me/workers"],
    "/me": ["/me"],
    "/help": ["/help"],
    "/help/interface": ["/help/interface"],
    "/help/{name}": ["/help/theory", "/help/guide"],
    "/problems/{slug}": ["/problems/not-found"],
    "/me/audit": ["/me/audit"],
    "/me/settings": ["/me/settings"],
    "/me/tokens": ["/me/tokens?id=none"],
    "/me/users": ["/me/users"],
    "/nights": ["/nights"],
    "/nights/new": ["/nights/new"],
    "/nights/{schedule_id}": ["/nights/{SCHEDULE}"],
    "/compare": ["/compare?study={STUDY}&study={OTHER}"],
    "/studies/{study_id}": [
        *(f"/studies/{{STUDY}}{chosen}" for chosen in ("", "?y=nothing", "?z=shaft.speed.mean")),
        *(f"/studies/{{{name}}}" for name in ("SHAFT", "RUNNING", "GOAL", "DRIVES", "CALIBRATION")), "/studies/none",
    ],
    "/studies/{study_id}/document": [
        "/studies/{STUDY}/document?appendix=inputs&text=A", "/studies/{GOAL}/document", "/studies/{DRIVES}/document",
    ],
    "/studies/{study_id}/delete": ["/studies/{STUDY}/delete"],
    "/studies/{study_id}/extend": ["/studies/{STUDY}/extend"],
    "/studies/{study_id}/rows": [
        "/studies/{STUDY}/rows", "/studies/{STUDY}/rows?plot=points&outside=1&where=efficiency+%3E%3D+0.5&row=3",
        "/studies/{STUDY}/rows?of=efficiency&least=x", "/studies/{STUDY}/rows?case=0&case=1", "/studies/{GOAL}/rows",
        "/studies/{DRIVES}/rows",
    ],
    "/studies/{study_id}/rows/new": ["/studies/{STUDY}/rows/new?case=0"],
    "/studies/{study_id}/matters": [
        "/studies/{STUDY}/matters", "/studies/{STUDY}/matters?ask=measurement", "/studies/{DRIVES}/matters",
        "/studies/{CALIBRATION}/matters", "/studies/{SHAFT}/matters", "/studies/{GOAL}/matters",
    ],
    "/studies/{study_id}/cases/{case}": [
        "/studies/{STUDY}/cases/0", "/studies/{SHAFT}/cases/0", "/studies/{SHAFT}/cases/0?show=transient",
        *(
            f"/studies/{{STUDY}}/cases/0?show={part}"
            for part in ("engagements", "duty", "forces", "strobes", "section", "startup", "branch")
        ),
    ],
    "/studies/{study_id}/cases/{case}/laboratory": ["/studies/{STUDY}/cases/0/laboratory"],
}  # fmt: skip


def preset(name: str) -> Any:
    """The spec of a preset."""
    file, text = preset_text(name)
    return load_spec(text, "toml" if file.endswith("toml") else "json")


def studies(service: Service) -> dict[str, str]:
    """Ids of studies of every kind and of a schedule."""
    ids = {name: service.submit(preset("one_pendulum")) for name in ("STUDY", "OTHER", "RUNNING")}
    ids |= {"SHAFT": service.submit(preset("question_masses"))}
    drives = {**preset("tolerances"), "drives": 8}
    ids |= {"DRIVES": service.submit(drives)}
    for name in ("STUDY", "OTHER", "SHAFT", "DRIVES"):
        service.fill(ids[name])
    ids |= {"GOAL": search(service), "CALIBRATION": calibration(service)}
    schedule = {"spec": preset("one_pendulum"), "cron": "0 22 * * 1-5", "name": LONG, "window": ["22:00", "06:00"],
                "zone": "America/Argentina/ComodRivadavia"}  # fmt: skip
    ids |= {"SCHEDULE": service.http.post("/api/v1/schedules", json=schedule).json()["id"]}
    night(service)
    view = {"page": "curves", "study": ids["STUDY"], "name": LONG, "in_report": True}
    assert service.http.post("/api/v1/views", json=view).status_code == 200
    return ids


def night(service: Service) -> None:
    """A schedule that was due a minute ago, and whose study has ended."""
    now = datetime.now(UTC)
    at = (now - timedelta(minutes=1)).isoformat()
    fields = {"spec": preset("one_pendulum"), "at": at, "name": LONG, "zone": "Europe/Kyiv"}
    service.store.schedules.create(read_fields(fields, now - timedelta(minutes=2)))
    scheduler = Scheduler(service.store)
    scheduler.look()
    service.fill(service.store.studies.page().studies[0].id)
    scheduler.look()
    assert all(run["stages"] for run in service.get("/night")["runs"])


def judged(page: Page) -> Page:
    """The tab, whose pages have axe from their beginning: given to each anew it would be compiled from its text."""
    page.add_init_script(AXE_SCRIPT)
    return page


def findings(page: Page, options: dict[str, Any]) -> list[str]:
    """What axe finds on the page as it is."""
    found: list[str] = page.evaluate(FINDINGS, {"resultTypes": ["violations"], "selectors": False, **options})
    return found


def test_axe_finds_nothing_on_any_page_and_each_fits_the_screen(
    service: Service, open_tab: Callable[..., Page]
) -> None:
    """In English, light and wide; in Ukrainian, dark and narrow: these show what any other combination would."""
    english = judged(open_tab(locale="en-GB", viewport=DESKTOP, color_scheme="light"))
    ukrainian = judged(open_tab(locale="uk-UA", viewport=PHONE, color_scheme="dark"))
    pages = (english, ukrainian)
    found = dict[str, list[str]]()

    def judge(name: str) -> None:
        for size in (TABLET, PHONE):
            ukrainian.set_viewport_size(size)
            if beside := ukrainian.evaluate(BEYOND):
                found[f"{name}, wider than {size['width']} px"] = [beside]
        for page in pages:
            if twice := page.evaluate(SHORTER, page is ukrainian):
                found[f"{name}, ids"] = twice
        if bad := findings(english, {}):
            found[name] = bad
        if bad := findings(ukrainian, {"runOnly": NARROW}):
            found[f"{name}, in Ukrainian, dark and narrow"] = bad

    for page in pages:
        page.goto("/")
    judge("an empty list")
    for page in pages:
        page.goto("/new?preset=one_pendulum")
        named(page, "/base/shaft/inertia").fill("2 mm")
        with page.expect_navigation():
            page.locator('button[value="submit"]').first.click()
    judge("a refused form")
    ids = studies(service)
    for address in (address.format(**ids) for addresses in PAGES.values() for address in addresses):
        for page in pages:
            answer = page.goto(address)
            assert answer is not None, address
            assert answer.headers["content-type"].startswith("text/html"), address
            page.wait_for_function(DRAWN)
        judge(address)
    assert not found, json.dumps(found, indent=1)
    assert ukrainian.locator("html").get_attribute("lang") == "uk"


def test_what_is_alike_is_judged_once_and_what_differs_each(open_tab: Callable[..., Page]) -> None:
    page = judged(open_tab())
    page.goto("/problems/not-found")
    rows, unnamed = "<tr><td><label>Load <input></label></td></tr>" * 9, "<tr><td><input></td></tr>"

    def shown(*parts: str) -> str:
        body = f"<h1>A page</h1><table><tbody>{''.join(parts)}</tbody></table><p id=a>1</p><p id=a class=b>2</p>"
        page.set_content(f"<html lang=en><title>A page</title><main>{body}</main></html>")
        assert page.evaluate(SHORTER, True) == ["a"]
        return page.locator("tbody").inner_html()

    assert shown(rows, unnamed, rows) == rows[: len(rows) // 9 * 2] + unnamed
    assert [one.partition(":")[0] for one in findings(page, {"runOnly": NARROW})] == ["label"]
    assert shown(rows, unnamed, rows) == ""  # an earlier page had it
    marked = rows.replace("<td>", "<td class=marked>", 1)
    assert "marked" in shown(marked)
    assert page.locator("tr").count() == 1


def test_no_other_route_answers_with_a_page(service: Service) -> None:
    """A new page has to be judged too; a figure that a script puts into its page is none."""
    study = service.submit()
    service.fill(study)
    schedule = service.http.post("/api/v1/schedules", json={"spec": SPEC, "cron": "0 22 * * *"}).json()["id"]
    ids = {"study_id": study, "case": "0", "schedule_id": schedule, "slug": "x", "name": "live.js", "form": "svg",
           "model": "drive", "part": "figure"}  # fmt: skip
    programs = ("/api/", "/live/", "/docs/site/")  # what makes the site of the documentation judges its pages
    others = [path for verb, path in map(str.split, ROLES) if verb == "GET" and not path.startswith(programs)]
    assert set(PAGES) <= set(others)
    for pattern in others:
        if pattern not in PAGES:
            answer = service.http.get(pattern.format(**(ids if "docs" not in pattern else {"name": "theory"})))
            assert answer.status_code in (200, 303, 308, 422), pattern
            assert "<html" not in answer.text[:200], pattern
