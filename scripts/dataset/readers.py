"""Five programs that read Parquet, one class each: types and values of a data set's columns in one common form.

`types` is {column: (type, length of its list or None)} as the program itself declares it, with the type names of
`spts dataset schema --json`; what the program does not declare is "any". `columns` is {column: (values, is_null)}: values
have the shape (rows,) or (rows, length), texts are objects, and what is null has the value 0 or "".
"""

import duckdb
import numpy as np
import pandas
import polars
import pyarrow
import pyarrow.compute
import pyarrow.dataset

KINDS = {"i32": np.int32, "i64": np.int64, "f32": np.float32, "bool": np.bool_, "text": object}
ARROW = {pyarrow.int32(): "i32", pyarrow.int64(): "i64", pyarrow.float32(): "f32", pyarrow.bool_(): "bool", pyarrow.string(): "text"}
# a type or length that a program does not say
ANY = "any"


def of_arrow(table):
    """Values of an Arrow table of any list types."""
    out = {}
    for name in table.column_names:
        array = table[name].combine_chunks()
        is_null = np.asarray(array.is_null())
        if pyarrow.types.is_nested(array.type):
            assert not is_null.any(), f"{name}: a list is null"
            assert len(pyarrow.compute.list_value_length(array).unique()) == 1, f"{name}: lists of several lengths"
            flat = array.flatten()
            assert flat.null_count == 0, f"{name}: a value of a list is null"
            out[name] = flat.to_numpy(zero_copy_only=False).reshape(len(array), -1), is_null
        elif pyarrow.types.is_string(array.type):
            out[name] = np.array(array.fill_null("").to_pylist(), object), is_null
        else:
            zero = pyarrow.scalar(False if pyarrow.types.is_boolean(array.type) else 0, array.type)
            out[name] = array.fill_null(zero).to_numpy(zero_copy_only=False), is_null
    return out


def arrow_type(field):
    kind = field.type
    if pyarrow.types.is_fixed_size_list(kind):
        return ARROW[kind.value_type], kind.list_size
    return ARROW[kind], None


class PyArrow:
    def __init__(self, folder):
        self.data = pyarrow.dataset.dataset(folder / "data", format="parquet")

    def types(self):
        return {field.name: arrow_type(field) for field in self.data.schema}

    def columns(self):
        return of_arrow(self.data.to_table())

    def rows_of_split(self, split):
        return self.data.count_rows(filter=pyarrow.dataset.field("split") == split)


class DuckDb:
    NAMES = {"INTEGER": "i32", "BIGINT": "i64", "FLOAT": "f32", "BOOLEAN": "bool", "VARCHAR": "text"}

    def __init__(self, folder):
        self.connection = duckdb.connect()
        self.connection.execute(f"CREATE VIEW touches AS SELECT * FROM read_parquet('{folder}/data/*.parquet')")

    def types(self):
        rows = self.connection.execute("DESCRIBE touches").fetchall()
        # Parquet has no fixed lengths; DuckDB does not read the Arrow schema that has them
        return {name: (self.NAMES[kind.removesuffix("[]")], ANY if kind.endswith("[]") else None) for name, kind, *_ in rows}

    def columns(self):
        return of_arrow(self.connection.sql("SELECT * FROM touches ORDER BY index").to_arrow_table())

    def rows_of_split(self, split):
        return self.connection.execute("SELECT count(*) FROM touches WHERE split = ?", [split]).fetchone()[0]


class Polars:
    NAMES = {polars.Int32: "i32", polars.Int64: "i64", polars.Float32: "f32", polars.Boolean: "bool", polars.String: "text"}

    def __init__(self, folder):
        self.data = polars.scan_parquet(folder / "data/*.parquet")

    def types(self):
        return {name: self.type_of(kind) for name, kind in self.data.collect_schema().items()}

    def type_of(self, kind):
        return (self.NAMES[kind.inner], kind.size) if isinstance(kind, polars.Array) else (self.NAMES[kind], None)

    def columns(self):
        out = {}
        for column in self.data.collect():
            is_null = column.is_null().to_numpy()
            if column.dtype == polars.String:
                column = column.fill_null("")
            elif not isinstance(column.dtype, polars.Array):
                column = column.fill_null(False if column.dtype == polars.Boolean else 0)
            out[column.name] = column.to_numpy(), is_null
        return out

    def rows_of_split(self, split):
        return self.data.filter(polars.col("split") == split).select(polars.len()).collect().item()


class Pandas:
    def __init__(self, folder):
        self.frame = pandas.read_parquet(folder / "data")

    def types(self):
        out = {}
        for name, column in self.frame.items():
            first = column.iloc[0]
            if isinstance(first, np.ndarray):
                out[name] = ARROW[pyarrow.from_numpy_dtype(first.dtype)], len(first)
            elif isinstance(column.dtype, pandas.StringDtype):
                out[name] = "text", None
            elif column.hasnans and column.dtype == np.float64:
                # integers with nulls become float64 unless pandas is asked for others; these fit into one exactly
                out[name] = ANY, None
            else:
                out[name] = ARROW[pyarrow.from_numpy_dtype(column.dtype)], None
        return out

    def columns(self):
        out = {}
        for name, column in self.frame.items():
            is_null = column.isna().to_numpy()
            if isinstance(column.iloc[0], np.ndarray):
                out[name] = np.stack(column.to_list()), is_null
            else:
                out[name] = column.fillna("" if isinstance(column.dtype, pandas.StringDtype) else 0).to_numpy(), is_null
        return out

    def rows_of_split(self, split):
        return int((self.frame["split"] == split).sum())


class HuggingFace:
    """`load_dataset` of the whole folder, which reads the head of its README.md."""

    NAMES = {"int32": "i32", "int64": "i64", "float32": "f32", "bool": "bool", "string": "text"}

    def __init__(self, folder):
        import datasets  # takes seconds

        self.data = datasets.load_dataset(str(folder))

    def types(self):
        first, *others = [part.features for part in self.data.values()]
        assert all(part == first for part in others)
        return {name: self.type_of(feature) for name, feature in first.items()}

    def type_of(self, feature):
        return (self.NAMES[feature.feature.dtype], feature.length) if hasattr(feature, "length") else (self.NAMES[feature.dtype], None)

    def columns(self):
        table = pyarrow.concat_tables([part.with_format("arrow")[:] for part in self.data.values()])
        return of_arrow(table.sort_by("index"))

    def rows_of_split(self, split):
        return sum(part.filter(lambda name: name == split, input_columns="split").num_rows for part in self.data.values())


READERS = [PyArrow, DuckDb, Polars, Pandas, HuggingFace]
