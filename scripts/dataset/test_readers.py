"""Five programs read a data set: what `spts dataset schema` says, and the same values, bit for bit."""

import functools
import json

import numpy as np
import pandas
import polars
import pytest
import readers

SETS = ["shapes", "several", "codes"]
SPLITS = ["train", "validation", "test"]

each_set = pytest.mark.parametrize("made", SETS, indirect=True)
each_reader = pytest.mark.parametrize("reader", readers.READERS, ids=lambda reader: reader.__name__)


@functools.cache
def opened(reader, folder):
    return reader(folder)


@functools.cache
def columns(reader, folder):
    return opened(reader, folder).columns()


def declared(made):
    """{column: (type, length or None)} as the program says."""
    return {column["name"]: (column["kind"], column.get("length")) for column in made.schema}


@each_set
@each_reader
def test_types_are_those_of_the_schema(reader, made):
    expected, found = declared(made), opened(reader, made.folder).types()
    assert list(found) == list(expected)
    for name, (kind, length) in found.items():
        assert kind in (expected[name][0], readers.ANY), name
        assert (length is None) == (expected[name][1] is None), name
        assert length in (expected[name][1], readers.ANY), name


@each_set
@each_reader
def test_shapes_are_rows_times_length(reader, made):
    expected = declared(made)
    for name, (values, is_null) in columns(reader, made.folder).items():
        length = expected[name][1]
        rows = made.info["rows"]
        assert is_null.shape == (rows,), name
        assert values.shape == ((rows,) if length is None else (rows, length)), name


@each_set
@each_reader
def test_values_are_those_of_pyarrow_bit_for_bit(reader, made):
    expected, kinds = columns(readers.PyArrow, made.folder), declared(made)
    found = columns(reader, made.folder)
    assert list(found) == list(expected)
    for name, (values, is_null) in found.items():
        reference, null_reference = expected[name]
        assert np.array_equal(is_null, null_reference), f"{name}: nulls"
        kind = readers.KINDS[kinds[name][0]]
        if kind is object:
            assert list(values) == list(reference), name
        else:
            exact = np.asarray(values).astype(kind)
            assert np.array_equal(exact.astype(values.dtype), values), f"{name}: more than {kind.__name__} holds"
            assert exact.tobytes() == reference.astype(kind, casting="equiv").tobytes(), name


@each_set
@each_reader
def test_splits_are_those_of_the_statistics(reader, made):
    statistics = json.loads((made.folder / "statistics.json").read_text())
    (said,) = [column["texts"] for column in statistics["columns"] if column["name"] == "split"]
    found = {split: opened(reader, made.folder).rows_of_split(split) for split in SPLITS}
    assert found == {split: said.get(split, 0) for split in SPLITS}
    assert sum(found.values()) == made.info["rows"]


def test_the_lines_of_the_help_read_the_files(shapes):
    import datasets

    assert len(datasets.load_dataset("parquet", data_dir=str(shapes.folder / "data"))["train"]) == 400
    assert len(polars.read_parquet(f"{shapes.folder}/data/*.parquet")) == 400
    assert len(pandas.read_parquet(f"{shapes.folder}/data")) == 400


def test_the_data_set_with_several_objects_has_all_splits(several):
    split, _ = columns(readers.PyArrow, several.folder)["split"]
    assert set(split) == set(SPLITS)


@each_set
def test_no_split_shares_a_press_or_a_shape_with_another(made):
    found = columns(readers.PyArrow, made.folder)
    split = found["split"][0]
    owners = {}
    for name in found:
        group = "shape" if name == "shape" or name.startswith("shape_") else name
        if group not in ("press", "shape"):
            continue
        values, is_null = found[name]
        for value, part in zip(values[~is_null], split[~is_null]):
            assert owners.setdefault((group, value), part) == part, f"{name} {value} is in two splits"


@each_set
def test_columns_of_an_object_are_null_where_there_is_none_and_nothing_else_is(made):
    found = columns(readers.PyArrow, made.folder)
    objects, _ = found["objects"]
    most = 3 if "object_3" in found else 1
    assert set(objects) == set(range(1, most + 1))
    for name, (_, is_null) in found.items():
        number = int(name[-1]) if name.endswith(("_2", "_3")) else 1
        assert np.array_equal(is_null, objects < number), name


def test_rows_are_in_order_and_numbered(several):
    found = columns(readers.PyArrow, several.folder)
    index = np.arange(several.info["rows"])
    assert np.array_equal(found["index"][0], index)
    assert np.array_equal(found["press"][0], index // 2)
    assert np.array_equal(found["window"][0], index % 2)
