"""What is said of other programs: equal forms in one row, the whole model first, reasons where nothing can be made."""

from __future__ import annotations

import math
from dataclasses import replace

from linid.diagnosis.report_data import ExportLoss
from linid.report.diagnosis.exports import export_rows
from linid.report.diagnosis.files import diagnosis_data
from linid.report.diagnosis.markdown import diagnosis_markdown
from linid.report.page.build import page_html
from tests.report.diagnosis_samples import explained

NOTHING = (math.nan, math.nan, math.nan)
TOLD = (
    ExportLoss(("urdf", "ros2"), False, {"ahead": (0.61, 0.5, 0.7), "free_run": NOTHING}, ("No Stribeck curve.",)),
    ExportLoss(("isaac",), False, {}, (), "isaac: needs a mass"),
    ExportLoss(("python", "c"), True, {"ahead": (1.0, 1.0, 1.0)}, ()),
)


def test_a_row_says_what_is_kept_what_lacks_and_why_not() -> None:
    rows = export_rows(replace(explained(), exports=TOLD))
    assert rows == (
        ("python, c", "all", "all", "The whole model is held."),
        ("urdf, ros2", "61 % [50, 70] %", "-", "No Stribeck curve."),
        ("isaac", "-", "-", "isaac: needs a mass"),
    )


def test_page_text_and_data_have_the_table_and_are_without_it_where_nothing_was_named() -> None:
    told, plain = replace(explained(), exports=TOLD), explained()
    for text in (page_html(told), diagnosis_markdown(told)):
        assert "In other programs" in text and "urdf, ros2" in text and "No Stribeck curve." in text
    for text in (page_html(plain), diagnosis_markdown(plain)):
        assert "In other programs" not in text
    (first, *_) = diagnosis_data(told)["exports"]
    assert list(first["targets"]) == ["urdf", "ros2"] and list(first["kept"]["free_run"]) == [None] * 3
