"""The form of a new study in a browser: its one button undoes what was typed and what was added; columns are pasted."""

from __future__ import annotations

from typing import TYPE_CHECKING

from playwright.sync_api import expect

from tests.service.http.web.fields import named

if TYPE_CHECKING:
    from tests.service.http.web.conftest import Visitor

_PASTE = """([name, text]) => {
  const data = new DataTransfer();
  data.setData("text", text);
  document.getElementById(name).dispatchEvent(new ClipboardEvent("paste", {clipboardData: data, bubbles: true}));
}"""


def test_what_is_typed_and_what_is_added_is_undone(visitor: Visitor) -> None:
    page = visitor.page
    page.goto("/new?preset=one_pendulum")
    undo = page.get_by_role("button", name="Undo")
    expect(undo).to_be_disabled()
    mass = named(page, "/base/pendulums/0/mass")
    before = mass.input_value()
    mass.fill("0,7 кг")
    mass.blur()
    expect(page.locator("#panel .draft")).to_contain_text("settled")
    page.get_by_role("button", name="Add a pendulum").click()
    expect(named(page, "/base/pendulums/1/mass")).to_have_value("0,7")
    undo.click()
    expect(page.locator('[name="/base/pendulums/1/mass"]')).to_have_count(0)
    expect(mass).to_have_value("0,7")
    undo.click()
    expect(mass).to_have_value(before)
    expect(undo).to_be_disabled()


def test_columns_of_a_spreadsheet_are_pasted_into_an_axis(visitor: Visitor) -> None:
    page = visitor.page
    page.goto("/new?preset=one_pendulum")
    text = "shaft.load [N*mm]\texcitation.frequency [Hz]\n50\t24\n100,5\t25\n"
    page.evaluate(_PASTE, ["/axes/0/values", text])
    expect(named(page, "/axes/1/values")).to_have_value("24; 25")
    expect(named(page, "/axes/0/values")).to_have_value("50; 100.5")
    expect(named(page, "unit:/axes/0")).to_have_value("N*mm")
    expect(page.locator("#panel .draft")).to_contain_text("2 axes, value by value")
    page.get_by_role("button", name="Undo").click()
    expect(page.get_by_text("value by value:")).to_have_count(0)
