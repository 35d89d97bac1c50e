"""The checks of conftest.py notice what they are for."""

import pytest

FAULTS = {
    "wide": "<div style='width:3000px'>wide</div>",
    "picture": "<img src='missing.png' alt=''>",
    "console": "<script>console.error('no')</script>",
    "error": "<script>undefined.field</script>",
}


def page(folder, body):
    path = folder / "page.html"
    path.write_text(f"<!doctype html><html lang=en><title>t</title><body>{body}</body></html>")
    return path


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_noticed(fault, visit, tmp_path):
    one = visit(390)
    one.open(page(tmp_path, FAULTS[fault]))
    with pytest.raises(AssertionError):
        one.check()


def test_a_page_without_faults_passes(visit, tmp_path):
    one = visit(390)
    one.open(page(tmp_path, "<h1>Good</h1>"))
    one.check()
