"""What describes a data set to people and programs: manifest, Hugging Face card, Croissant."""

import hashlib
import itertools
import json

import mlcroissant
import pandas
import pytest
import readers
import yaml

each_set = pytest.mark.parametrize("made", ["shapes", "several"], indirect=True)


def card_head(folder):
    """The head of README.md, which Hugging Face reads."""
    _, head, _ = (folder / "README.md").read_text().split("---\n", 2)
    return yaml.safe_load(head)


@each_set
def test_the_manifest_has_size_and_sum_of_every_file(made):
    manifest = json.loads((made.folder / "manifest.json").read_text())
    files = {path.relative_to(made.folder).as_posix() for path in made.folder.rglob("*") if path.is_file()}
    assert set(manifest["files"]) == files - {"manifest.json"}
    for name, said in manifest["files"].items():
        content = (made.folder / name).read_bytes()
        assert said == {"bytes": len(content), "sha256": hashlib.sha256(content).hexdigest()}, name


@each_set
def test_the_digest_is_that_of_the_files_of_rows_alone(made):
    """What `sha256sum data/*.parquet | sha256sum` prints."""
    parts = sorted((made.folder / "data").glob("*.parquet"))
    lines = [f"{hashlib.sha256(part.read_bytes()).hexdigest()}  data/{part.name}\n" for part in parts]
    assert made.info["digest"] == hashlib.sha256("".join(lines).encode()).hexdigest()


@each_set
def test_the_head_of_the_card_is_what_hugging_face_wants(made):
    head = card_head(made.folder)
    assert head["license"] == "cc-by-4.0"
    assert head["size_categories"] == ["n<1K"]
    assert head["pretty_name"] == made.info["name"]
    (config,) = head["configs"]
    patterns = config["data_files"] if isinstance(config["data_files"], list) else [{"path": config["data_files"]}]
    found = {path for part in patterns for path in made.folder.glob(part["path"])}
    assert found == set((made.folder / "data").glob("*.parquet"))


def test_the_card_has_the_size_category_of_more_rows(program):
    made = program.make("more", "presses-17", "--rows", 1000)
    assert card_head(made.folder)["size_categories"] == ["1K<n<10K"]


@each_set
def test_the_card_has_a_line_for_every_column(made):
    text = (made.folder / "README.md").read_text()
    for column in made.schema:
        assert f"\n| `{column['name']}` |" in text, column["name"]


@each_set
def test_croissant_is_valid_and_names_every_column(made):
    data = mlcroissant.Dataset(made.folder / "croissant.json")  # raises what is not valid
    (records,) = data.metadata.record_sets
    kinds = {"text": "sc:Text", "bool": "sc:Boolean", "i32": "sc:Integer", "i64": "sc:Integer", "f32": "sc:Float"}
    written = json.loads((made.folder / "croissant.json").read_text())["recordSet"][0]["field"]
    assert [(field["name"], field["dataType"], field.get("repeated", False)) for field in written] == [
        (column["name"], kinds[column["kind"]], "length" in column) for column in made.schema
    ]
    assert [field.name for field in records.fields] == [column["name"] for column in made.schema]


@each_set
def test_records_that_croissant_reads_are_the_rows(made):
    data = mlcroissant.Dataset(made.folder / "croissant.json")
    records = list(itertools.islice(data.records("rows"), 20))
    assert len(records) == 20
    expected = readers.PyArrow(made.folder).data.head(20).to_pylist()
    for record, row in zip(records, expected):
        assert record.keys() == {f"rows/{name}" for name in row}
        for name, value in row.items():
            found = record[f"rows/{name}"]
            found = found.decode() if isinstance(found, bytes) else found
            if value is None:
                assert found is None or pandas.isna(found), name
            else:
                assert found == value, name
