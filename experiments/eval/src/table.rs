//! The one shape of results: rows with columns, as text, HTML, CSV and JSON.

use crate::tally::ScoreColumn;
use serde::ser::{Serialize, SerializeMap, SerializeSeq, Serializer};
use spts::output::{CsvFile, OutputFolder};
use spts_input::Refusal;
use std::fmt::{self, Display};
use std::path::Path;

/// Rows with columns. A column says once what is known of a row, and everything is made of it: what a user reads (text
/// and HTML) and what a program reads (CSV and JSON).
///
/// Files have every number in SI units and in the fewest digits that read back as the same number; readers see the
/// decimals and the unit of the column. A column can also be for one of the two alone.
///
/// ```
/// use spts_eval::Table;
///
/// struct Size { taxels: usize, wires: usize, period_s: f64, measurements: Option<usize> }
/// let sizes = [
///     Size { taxels: 100, wires: 1, period_s: 15.5e-6, measurements: Some(20) },
///     Size { taxels: 1024, wires: 3, period_s: 2e-6, measurements: None },
/// ];
/// let table = Table::new("sizes", &sizes)
///     .column("taxels", "taxels", |r| r.taxels)
///     .file("wires", |r| r.wires)
///     .column("period_s", "period", |r| r.period_s).unit("µs", 1e6).digits(2)
///     .column("measurements", "M", |r| r.measurements)
///     .shown("share", |r| r.measurements.map(|m| m as f64 / r.taxels as f64)).unit("%", 100.0).digits(1);
/// assert_eq!(
///     table.text(),
///     "| taxels | period, µs |  M | share, % |\n\
///      |-------:|-----------:|---:|---------:|\n\
///      |    100 |      15.50 | 20 |     20.0 |\n\
///      |   1024 |       2.00 |  – |        – |\n"
/// );
/// let dir = std::env::temp_dir().join(format!("spts-doc-table-{}", std::process::id()));
/// # std::fs::create_dir_all(&dir)?;
/// table.write_csv(&dir.join("sizes.csv"))?;
/// let csv = std::fs::read_to_string(dir.join("sizes.csv"))?;
/// assert_eq!(csv, "taxels,wires,period_s,measurements\n100,1,0.0000155,20\n1024,3,2e-6,\n");
/// # std::fs::remove_dir_all(&dir)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Table<'a, R> {
    name: String,
    rows: Vec<R>,
    columns: Vec<Column<'a, R>>,
}

/// A column: its name in files, its heading for readers, and what it says of a row.
struct Column<'a, R> {
    /// Name in CSV and JSON; a column for readers alone has none.
    key: Option<String>,
    /// Heading in text and HTML; a column of files alone has none.
    head: Option<String>,
    /// Decimals for readers; without, as many as a number needs.
    digits: Option<usize>,
    /// What readers see of a number: the number times this.
    scale: f64,
    value: Box<dyn Fn(R) -> Cell + 'a>,
}

/// A value in a table.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
#[serde(untagged)]
pub enum Cell {
    /// Not known: an empty field in CSV, `null` in JSON, a dash for readers.
    Unknown,
    /// Yes or no.
    Bool(bool),
    /// A whole number.
    Whole(i128),
    /// A number; one that is not finite is [`Cell::Unknown`].
    Number(f64),
    /// Words.
    Text(String),
}

impl Cell {
    /// The name by which `value`, such as a variant of an enum, is known in JSON.
    pub fn name_of(value: impl Serialize) -> Self {
        match serde_json::to_value(value) {
            Ok(serde_json::Value::String(name)) => Self::Text(name),
            Ok(other) if !other.is_null() => Self::Text(other.to_string()),
            _ => Self::Unknown,
        }
    }

    /// The two ends of an interval for readers, with `digits` decimals.
    pub fn span(interval: Option<[f64; 2]>, digits: usize) -> Self {
        interval.map(|[low, high]| format!("{low:.digits$}–{high:.digits$}")).into()
    }
}

impl<'a, R: Copy> Table<'a, R> {
    /// A table without columns; its CSV file is called `name`. The rows are references, or small values.
    pub fn new(name: impl Into<String>, rows: impl IntoIterator<Item = R>) -> Self {
        Self { name: name.into(), rows: rows.into_iter().collect(), columns: Vec::new() }
    }

    /// Adds a column for files and readers.
    pub fn column<V: Into<Cell>>(
        self,
        key: impl Into<String>,
        head: impl Into<String>,
        value: impl Fn(R) -> V + 'a,
    ) -> Self {
        self.with(Some(key.into()), Some(head.into()), value)
    }

    /// Adds a column for files alone.
    pub fn file<V: Into<Cell>>(self, key: impl Into<String>, value: impl Fn(R) -> V + 'a) -> Self {
        self.with(Some(key.into()), None, value)
    }

    /// Adds a column that files know by a short name, and readers by the `words` for it.
    pub fn named<N: Into<Cell>, W: Into<Cell>>(
        self,
        key: &str,
        head: &str,
        name: impl Fn(R) -> N + Copy + 'a,
        words: impl Fn(N) -> W + 'a,
    ) -> Self {
        self.file(key, name).shown(head, move |row| words(name(row)))
    }

    /// Adds the two ends of an interval as columns for files alone, `key`_low and `key`_high.
    pub fn interval(self, key: &str, value: impl Fn(R) -> Option<[f64; 2]> + Copy + 'a) -> Self {
        self.file(format!("{key}_low"), move |row| value(row).map(|[low, _]| low))
            .file(format!("{key}_high"), move |row| value(row).map(|[_, high]| high))
    }

    /// Adds a column for readers alone.
    pub fn shown<V: Into<Cell>>(self, head: impl Into<String>, value: impl Fn(R) -> V + 'a) -> Self {
        self.with(None, Some(head.into()), value)
    }

    /// A column of numbers with `digits` decimals, for readers alone.
    pub fn number<V: Into<Cell>>(self, head: impl Into<String>, digits: usize, value: impl Fn(R) -> V + 'a) -> Self {
        self.shown(head, value).digits(digits)
    }

    /// Columns of scores, for files alone.
    pub(crate) fn files<S: 'a>(self, scores: &[ScoreColumn<S>], of: impl Fn(R) -> &'a S + Copy + 'a) -> Self {
        let columns = scores.iter().copied();
        columns.fold(self, |table, (name, get)| table.file(name, move |row| get(of(row))))
    }

    fn with<V: Into<Cell>>(mut self, key: Option<String>, head: Option<String>, value: impl Fn(R) -> V + 'a) -> Self {
        self.columns.push(Column {
            key,
            head,
            digits: None,
            scale: 1.0,
            value: Box::new(move |row| value(row).into()),
        });
        self
    }

    /// Readers see `digits` decimals in the column before.
    pub fn digits(mut self, digits: usize) -> Self {
        if let Some(column) = self.columns.last_mut() {
            column.digits = Some(digits);
        }
        self
    }

    /// Readers see the column before in `unit`, of which `scale` are one of the file's; the heading names it.
    pub fn unit(mut self, unit: &str, scale: f64) -> Self {
        if let Some(column) = self.columns.last_mut() {
            column.scale = scale;
            column.head = column.head.take().map(|head| format!("{head}, {unit}"));
        }
        self
    }

    /// What readers see.
    pub fn for_readers(&self) -> TextTable {
        let shown: Vec<_> = self.columns.iter().filter(|c| c.head.is_some()).collect();
        let row = |row: &R| shown.iter().map(|c| c.text(*row)).collect();
        TextTable {
            head: shown.iter().filter_map(|c| c.head.clone()).collect(),
            rows: self.rows.iter().map(row).collect(),
        }
    }

    /// What readers see, as a Markdown table with aligned columns.
    pub fn text(&self) -> String {
        self.for_readers().to_string()
    }

    /// Writes the table as NAME.csv into the folder `out`.
    ///
    /// # Errors
    /// [`Refusal`] if the file cannot be written.
    pub fn write(&self, out: &OutputFolder) -> Result<(), Refusal> {
        self.write_csv(&out.path(&format!("{}.csv", self.name)))
    }

    /// Writes the table as CSV.
    ///
    /// # Errors
    /// [`Refusal`] if the file cannot be written.
    pub fn write_csv(&self, path: &Path) -> Result<(), Refusal> {
        let header: Vec<&str> = self.in_files().map(|(key, _)| key).collect();
        let mut file = CsvFile::create(path, &header)?;
        for row in &self.rows {
            let known = |cell| match cell {
                Cell::Number(value) if !value.is_finite() => Cell::Unknown,
                known => known,
            };
            let cells: Vec<Cell> = self.in_files().map(|(_, column)| known((column.value)(*row))).collect();
            file.push(cells)?;
        }
        file.finish()
    }

    fn in_files(&self) -> impl Iterator<Item = (&str, &Column<'a, R>)> {
        self.columns.iter().filter_map(|c| Some((c.key.as_deref()?, c)))
    }
}

/// An array of objects, one a row.
impl<R: Copy> Serialize for Table<'_, R> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        struct Row<'t, 'a, R>(&'t Table<'a, R>, R);
        impl<R: Copy> Serialize for Row<'_, '_, R> {
            fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                let mut map = serializer.serialize_map(None)?;
                for (key, column) in self.0.in_files() {
                    map.serialize_entry(key, &(column.value)(self.1))?;
                }
                map.end()
            }
        }
        let mut rows = serializer.serialize_seq(Some(self.rows.len()))?;
        for row in &self.rows {
            rows.serialize_element(&Row(self, *row))?;
        }
        rows.end()
    }
}

impl<R> Column<'_, R> {
    /// What readers see of `row`.
    fn text(&self, row: R) -> String {
        match (self.value)(row) {
            Cell::Number(value) if !value.is_finite() => "–".to_owned(),
            Cell::Number(value) => match self.digits {
                Some(digits) => format!("{:.digits$}", value * self.scale),
                None => (value * self.scale).to_string(),
            },
            Cell::Whole(value) => value.to_string(),
            Cell::Bool(value) => if value { "yes" } else { "no" }.to_owned(),
            Cell::Text(words) => words,
            Cell::Unknown => "–".to_owned(),
        }
    }
}

/// A table as readers see it: words alone. As text ([`Display`]) it is a Markdown table with aligned columns.
///
/// A column of numbers is set flush right: cells that begin with a digit, perhaps after a sign or a comparison, and
/// dashes for what is not known.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct TextTable {
    /// Headings of the columns.
    pub head: Vec<String>,
    /// Cells, row by row.
    pub rows: Vec<Vec<String>>,
}

/// A number with `digits` decimals, or a dash.
pub(crate) fn fixed(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "–".to_owned(), |v| format!("{v:.digits$}"))
}

impl TextTable {
    pub(crate) fn new<'a>(head: impl IntoIterator<Item = &'a str>, rows: impl Iterator<Item = Vec<String>>) -> Self {
        Self { head: head.into_iter().map(str::to_owned).collect(), rows: rows.collect() }
    }

    /// The table as an HTML element; cells of numbers have the class `number`.
    pub fn html(&self) -> String {
        let flush = self.flush_right();
        let row = |cells: &[String], tag: &str| {
            let cell = |(column, right): (usize, &bool)| {
                let class = if *right { " class=\"number\"" } else { "" };
                let scope = if tag == "th" { " scope=\"col\"" } else { "" };
                let words = escape(cells.get(column).map_or("", String::as_str));
                format!("<{tag}{scope}{class}>{words}</{tag}>")
            };
            format!("<tr>{}</tr>\n", flush.iter().enumerate().map(cell).collect::<String>())
        };
        let body: String = self.rows.iter().map(|cells| row(cells, "td")).collect();
        format!("<table>\n<thead>{}</thead>\n<tbody>\n{body}</tbody>\n</table>", row(&self.head, "th"))
    }

    /// Which columns are set flush right.
    fn flush_right(&self) -> Vec<bool> {
        let columns = self.rows.iter().chain([&self.head]).map(Vec::len).max().unwrap_or(0);
        let numbers = |column: usize| {
            let cells = self.rows.iter().filter_map(|row| row.get(column));
            let mut known = cells.filter(|cell| !is_blank(cell)).peekable();
            known.peek().is_some() && known.all(|cell| is_number(cell))
        };
        (0..columns).map(numbers).collect()
    }
}

impl Display for TextTable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let cell = |row: &[String], column: usize| row.get(column).cloned().unwrap_or_default();
        let width = |column: usize| {
            let cells = self.rows.iter().chain([&self.head]);
            cells.map(|row| cell(row, column).chars().count()).max().unwrap_or(0).max(2)
        };
        let flush = self.flush_right();
        let widths: Vec<usize> = (0..flush.len()).map(width).collect();
        let line = |f: &mut fmt::Formatter<'_>, row: &[String]| {
            for (column, (&width, &right)) in widths.iter().zip(&flush).enumerate() {
                let words = cell(row, column);
                if right {
                    write!(f, "| {words:>width$} ")?;
                } else {
                    write!(f, "| {words:<width$} ")?;
                }
            }
            writeln!(f, "|")
        };
        line(f, &self.head)?;
        for (&width, &right) in widths.iter().zip(&flush) {
            let dashes = "-".repeat(width + 1);
            write!(f, "|{dashes}{}", if right { ":" } else { "-" })?;
        }
        writeln!(f, "|")?;
        self.rows.iter().try_for_each(|row| line(f, row))
    }
}

/// Whether a cell holds no value.
fn is_blank(cell: &str) -> bool {
    matches!(cell.trim(), "" | "-" | "–" | "—")
}

/// Whether a cell reads as a number, perhaps with a sign, an error, a unit sign or a comparison.
fn is_number(cell: &str) -> bool {
    let cell = cell.trim();
    let lead = cell.trim_start_matches(['+', '-', '−', '±', '≥', '≤', '<', '>', '≈', '~', ' ']);
    lead.starts_with(|c: char| c.is_ascii_digit())
        && lead.split_whitespace().count() <= 4
        && cell.chars().filter(|c| c.is_alphabetic()).count() <= 4
        || cell.eq_ignore_ascii_case("nan")
}

/// Text for XML and HTML, in content and in quoted attributes. Characters that XML forbids are dropped.
pub fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            '\t' | '\n' | '\r' => out.push(c),
            '\u{fffe}' | '\u{ffff}' => {}
            c if c < ' ' => {}
            c => out.push(c),
        }
    }
    out
}

impl<V: Into<Self>> From<Option<V>> for Cell {
    fn from(value: Option<V>) -> Self {
        value.map_or(Self::Unknown, Into::into)
    }
}

macro_rules! cells {
    ($($of:ty: |$value:ident| $cell:expr),+ $(,)?) => {
        $(impl From<$of> for Cell {
            fn from($value: $of) -> Self {
                $cell
            }
        })+
    };
}

cells!(
    bool: |value| Self::Bool(value),
    f64: |value| Self::Number(value),
    u8: |value| Self::Whole(value.into()),
    u32: |value| Self::Whole(value.into()),
    i32: |value| Self::Whole(value.into()),
    i64: |value| Self::Whole(value.into()),
    u64: |value| Self::Whole(value.into()),
    // a usize has 64 bits at most
    usize: |value| Self::Whole(i128::try_from(value).unwrap_or(i128::MAX)),
    String: |value| Self::Text(value),
    &str: |value| Self::Text(value.to_owned()),
    &String: |value| Self::Text(value.clone()),
);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_have_every_digit_and_json_the_same_keys() {
        let rows = [(1_u32, 0.1 + 0.2, true, "a,b"), (2, f64::NAN, false, "")];
        let table = Table::new("t", &rows)
            .column("id", "no.", |r| r.0)
            .column("share", "share", |r| r.1)
            .digits(1)
            .column("good", "good", |r| r.2)
            .file("words", |r| r.3);
        let dir = tempfile::tempdir().unwrap();
        table.write_csv(&dir.path().join("t.csv")).unwrap();
        let csv = std::fs::read_to_string(dir.path().join("t.csv")).unwrap();
        assert_eq!(csv, "id,share,good,words\n1,0.30000000000000004,true,\"a,b\"\n2,,false,\n");
        let json = serde_json::to_string(&table).unwrap();
        let first = r#"{"id":1,"share":0.30000000000000004,"good":true,"words":"a,b"}"#;
        assert_eq!(json, format!(r#"[{first},{{"id":2,"share":null,"good":false,"words":""}}]"#));
        assert_eq!(table.text().lines().nth(2), Some("|   1 |   0.3 | yes  |"));
        assert_eq!(table.text().lines().nth(3), Some("|   2 |     – | no   |"));
    }

    #[test]
    fn ragged_rows_and_markup_are_shown() {
        let words = |row: &[&str]| row.iter().map(|s| (*s).to_owned()).collect::<Vec<_>>();
        let table =
            TextTable { head: words(&["a<b", "≥ 1"]), rows: vec![words(&["x"]), words(&["y", "±0.5", "more"])] };
        assert_eq!(table.to_string().lines().count(), 4);
        let html = table.html();
        assert!(html.contains("a&lt;b") && html.contains("<td class=\"number\">±0.5</td>"));
        assert_eq!(TextTable::default().to_string(), "|\n|\n");
        assert_eq!(escape("a<b & \"c\" 'd'\u{0}>"), "a&lt;b &amp; &quot;c&quot; &#39;d&#39;&gt;");
    }
}
