//! Reads arrays and tables of frames from files: NumPy, MATLAB, numbers as text, and columns of a table.

use super::mat::read_mat_array;
use npyz::{DType, NpyFile, Order, TypeChar};
use spts_input::Refusal;
use std::io::{BufReader, Read};
use std::path::Path;

/// Most values of a file: 1 GB of doubles.
const MOST_VALUES: usize = 1 << 27;
/// Largest file of numbers as text, bytes.
const MOST_TEXT_BYTES: u64 = 1 << 30;
/// Largest binary file, bytes.
const MOST_BYTES: u64 = 1 << 31;
/// Names of arrays of frames and of their times or interval, s, as people call them.
const FRAME_NAMES: [&str; 6] = ["frames", "pressure", "pressures", "data", "tactile", "values"];
const TIME_NAMES: [&str; 5] = ["time_s", "time", "times", "timestamp", "t"];
const INTERVAL_NAMES: [&str; 3] = ["frame_s", "dt", "dt_s"];
const RATE_NAMES: [&str; 4] = ["rate_hz", "rate", "fs", "fps"];

/// Names of files that are read, as a user is told.
pub const FRAME_FILES: &str = ".npy, .npz, .csv, .tsv, .txt, .mat or .parquet";

/// A table or an array as it was read: values in C order, and what is told of time.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FrameArray {
    /// Size along each dimension; the last one varies fastest.
    pub shape: Vec<usize>,
    /// Values; NaN marks a missing one.
    pub values: Vec<f64>,
    /// Time of every frame, s; `None` if the file does not say.
    pub times_s: Option<Vec<f64>>,
    /// Frames a second; `None` if the file does not say.
    pub rate_hz: Option<f64>,
    /// What had to be taken for granted.
    pub notes: Vec<String>,
}

impl FrameArray {
    /// Reads the array in the file at `path`, by its extension: NumPy, MATLAB, or numbers as text. `variable` names an
    /// array of a file that has several. `taxels` are the columns that a text has beside one of times.
    ///
    /// # Errors
    /// [`Refusal`] with the file and what is wrong with it.
    pub fn read(path: &Path, variable: Option<&str>, taxels: usize) -> Result<Self, Refusal> {
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        let failed = Refusal::in_file(path);
        let in_file = |refusal: Refusal| refusal.at(path.display());
        let found = match extension.as_str() {
            "npy" => {
                let (file, _) = spts_input::open(path, MOST_BYTES).map_err(&failed)?;
                let (shape, values) = numpy(BufReader::new(file)).map_err(in_file)?;
                Self { shape, values, ..Self::default() }
            }
            "npz" => archive(path, variable).map_err(in_file)?,
            "csv" | "tsv" | "txt" | "dat" => {
                let text = spts_input::read_text(path, MOST_TEXT_BYTES).map_err(&failed)?;
                table(&text, taxels).map_err(in_file)?
            }
            "mat" => {
                let (found, times) = read_mat_array(path, variable, &FRAME_NAMES, &TIME_NAMES, taxels)?;
                let (shape, values) = c_order(&found.shape, &found.values);
                Self { shape, values, times_s: times.map(|times| times.values), ..Self::default() }
            }
            _ => {
                let problem = format!("is not a file of frames; valid: {FRAME_FILES}");
                return Err(in_file(Refusal::new(problem)));
            }
        };
        Ok(found)
    }

    /// The table of `columns`, each with its name and a value a frame. A column of times is found by its name.
    pub fn of_columns(columns: Vec<(String, Vec<f64>)>) -> Self {
        let (mut times_s, mut kept) = (None, Vec::new());
        for (name, values) in columns {
            match time_scale(&name) {
                Some(scale) if times_s.is_none() => times_s = Some(values.iter().map(|t| scale * t).collect()),
                _ => kept.push(values),
            }
        }
        let (frames, columns) = (kept.first().map_or(0, Vec::len), kept.len());
        let values = (0..frames)
            .flat_map(|k| kept.iter().map(move |column| column.get(k).copied().unwrap_or(f64::NAN)))
            .collect();
        Self { shape: vec![frames, columns], values, times_s, ..Self::default() }
    }
}

/// Seconds of a unit of the column of times called `name`; `None` for another column.
fn time_scale(name: &str) -> Option<f64> {
    let plain: String = name.to_lowercase().chars().filter(|c| c.is_ascii_alphanumeric()).collect();
    match plain.as_str() {
        "t" | "ts" | "time" | "times" | "timestamp" | "timestamps" | "timesec" | "seconds" | "timeseconds" => Some(1.0),
        "tms" | "timems" | "timestampms" | "milliseconds" | "ms" => Some(1e-3),
        "tus" | "timeus" | "timestampus" | "microseconds" | "us" => Some(1e-6),
        _ => None,
    }
}

/// The real numbers of a NumPy array of any type and order, and its shape.
fn numpy(reader: impl Read) -> Result<(Vec<usize>, Vec<f64>), Refusal> {
    let wrong = |error: std::io::Error| Refusal::new(format!("not a readable NumPy array ({error})"));
    let file = NpyFile::new(reader).map_err(wrong)?;
    let shape: Vec<usize> = file.shape().iter().map(|side| usize::try_from(*side).unwrap_or(usize::MAX)).collect();
    let count = shape.iter().try_fold(1_usize, |n, side| n.checked_mul(*side));
    if count.is_none_or(|count| count > MOST_VALUES) {
        return Err(Refusal::new(format!("shape {shape:?} has more than {MOST_VALUES} values")));
    }
    let DType::Plain(kind) = file.dtype() else {
        return Err(Refusal::new("an array of records; numbers are needed"));
    };
    let order = file.order();
    macro_rules! of {
        ($type:ty) => {{
            let data = file.data::<$type>().map_err(|e| Refusal::new(e.to_string()))?;
            #[expect(clippy::allow_attributes, reason = "some types need no cast")]
            #[allow(clippy::cast_lossless, clippy::unnecessary_cast, reason = "one line for all types")]
            let values = data.map(|value| value.map(|v| v as f64));
            values.collect::<std::io::Result<Vec<f64>>>().map_err(wrong)?
        }};
    }
    let values = match (kind.type_char(), kind.size_field()) {
        (TypeChar::Float, 8) => of!(f64),
        (TypeChar::Float, 4) => of!(f32),
        (TypeChar::Bool, _) => {
            let data = file.data::<bool>().map_err(|e| Refusal::new(e.to_string()))?;
            let values = data.map(|value| value.map(|v| f64::from(u8::from(v))));
            values.collect::<std::io::Result<Vec<f64>>>().map_err(wrong)?
        }
        (TypeChar::Int, 1) => of!(i8),
        (TypeChar::Int, 2) => of!(i16),
        (TypeChar::Int, 4) => of!(i32),
        (TypeChar::Int, 8) => of!(i64),
        (TypeChar::Uint, 1) => of!(u8),
        (TypeChar::Uint, 2) => of!(u16),
        (TypeChar::Uint, 4) => of!(u32),
        (TypeChar::Uint, 8) => of!(u64),
        _ => {
            return Err(Refusal::new(format!("values of type {kind}; integers or floats of 32 or 64 bits are needed")));
        }
    };
    Ok(match order {
        Order::C => (shape, values),
        Order::Fortran => c_order(&shape, &values),
    })
}

/// The arrays of a NumPy archive: frames, and what is told of time.
fn archive(path: &Path, variable: Option<&str>) -> Result<FrameArray, Refusal> {
    let (file, _) = spts_input::open(path, MOST_BYTES).map_err(Refusal::from)?;
    let damaged = |error: zip::result::ZipError| Refusal::new(format!("not a readable NumPy archive ({error})"));
    let mut archive = zip::ZipArchive::new(BufReader::new(file)).map_err(damaged)?;
    let names: Vec<String> = archive.file_names().map(|name| name.trim_end_matches(".npy").to_owned()).collect();
    let mut get = |name: &str| -> Result<(Vec<usize>, Vec<f64>), Refusal> {
        let entry = archive.by_name(&format!("{name}.npy")).map_err(damaged)?;
        numpy(BufReader::new(entry)).map_err(|e| e.at(name))
    };
    let chosen = match variable {
        Some(name) => names.iter().find(|known| *known == name),
        None if names.len() == 1 => names.first(),
        None => FRAME_NAMES.iter().find_map(|name| names.iter().find(|known| known.as_str() == *name)),
    };
    let Some(chosen) = chosen else {
        let wanted =
            variable.map_or_else(|| "which array are the frames".to_owned(), |name| format!("no array `{name}`"));
        return Err(Refusal::new(format!("{wanted}? it has {}: `--variable NAME`", names.join(", "))));
    };
    let (shape, values) = get(chosen)?;
    let mut one = |known: &[&str]| -> Result<Option<Vec<f64>>, Refusal> {
        let name = known.iter().find(|known| *known != chosen && names.iter().any(|name| name == *known));
        name.map(|name| get(name).map(|(_, values)| values)).transpose()
    };
    let times_s = one(&TIME_NAMES)?;
    let interval = one(&INTERVAL_NAMES)?.and_then(|v| v.first().copied()).map(|interval_s| 1.0 / interval_s);
    let rate_hz = one(&RATE_NAMES)?.and_then(|v| v.first().copied());
    Ok(FrameArray { shape, values, times_s, rate_hz: rate_hz.or(interval), notes: Vec::new() })
}

/// `values` of an array of `shape` in Fortran order, in C order.
fn c_order(shape: &[usize], values: &[f64]) -> (Vec<usize>, Vec<f64>) {
    let mut out = Vec::with_capacity(values.len());
    let mut index = vec![0; shape.len()];
    for _ in 0..values.len() {
        let at = index.iter().zip(shape).rev().fold(0, |at, (i, side)| at * side + i);
        out.push(values[at]);
        for k in (0..shape.len()).rev() {
            index[k] += 1;
            if index[k] < shape[k] {
                break;
            }
            index[k] = 0;
        }
    }
    (shape.to_vec(), out)
}

/// Numbers as text: a frame a line, or a line of taxels a line; with or without a header, with any usual separator.
fn table(text: &str, taxels: usize) -> Result<FrameArray, Refusal> {
    // tabs at the ends are missing values
    let lines = text.lines().enumerate().map(|(k, line)| (k + 1, line.trim_matches([' ', '\r'])));
    let mut lines = lines.filter(|(_, line)| !line.trim().is_empty() && !line.starts_with('#')).peekable();
    let Some((first_line, first)) = lines.peek().copied() else {
        return Err(Refusal::new("holds no numbers"));
    };
    let separator = [';', '\t', ','].into_iter().find(|mark| first.contains(*mark));
    // some writers end every line with a separator
    let ended = separator.filter(|mark| first.ends_with(*mark));
    let fields = |line: &str| -> Vec<String> {
        let trimmed = |field: &str| field.trim().trim_matches('"').trim().to_owned();
        let line = ended.and_then(|mark| line.strip_suffix(mark)).unwrap_or(line);
        match separator {
            Some(mark) => line.split(mark).map(trimmed).collect(),
            None => line.split_whitespace().map(trimmed).collect(),
        }
    };
    let mut notes = Vec::new();
    let header = fields(first);
    let names = is_header(&header);
    if names {
        lines.next();
    }
    let (mut rows, mut columns) = (Vec::new(), if names { header.len() } else { 0 });
    for (number_of, line) in lines {
        let at = |problem: String| Refusal::new(format!("line {number_of}: {problem}"));
        let row = fields(line);
        if columns == 0 {
            columns = row.len();
        }
        if row.len() != columns {
            let before = if names && rows.is_empty() { "names are in the header" } else { "are in the lines before" };
            return Err(at(format!("{} values; {columns} {before}", row.len())));
        }
        for field in &row {
            let Some(value) = number(field) else {
                let why = if is_decimal_comma(field) {
                    "has a decimal comma; decimal points are read"
                } else {
                    "is not a number"
                };
                return Err(at(format!("`{}` {why}", field.chars().take(40).collect::<String>())));
            };
            if value.is_infinite() {
                return Err(at(format!("`{field}` is not finite")));
            }
            rows.push(value);
            if rows.len() > MOST_VALUES {
                return Err(at(format!("more than {MOST_VALUES} values")));
            }
        }
    }
    if rows.is_empty() {
        return Err(Refusal::new("holds no numbers"));
    }
    let first_column = || rows.chunks_exact(columns).map(|row| row[0]);
    let named = header.iter().position(|name| names && time_scale(name).is_some());
    let scale = named.and_then(|at| time_scale(&header[at])).unwrap_or(1.0);
    let mut is_time = named.is_some();
    let at = named.or_else(|| {
        let ascends = rows.len() >= 2 * columns && first_column().is_sorted_by(|a, b| a < b);
        let counts = first_column().is_sorted_by(|a, b| (b - a - 1.0).abs() < 1e-9);
        (columns == taxels + 1 && ascends).then(|| {
            is_time = !counts;
            let taken = if counts { "counts the frames, is left out" } else { "ascends, is taken for time, s" };
            notes.push(format!("{columns} columns: the first one, which {taken}"));
            0
        })
    });
    if names && named.is_none() {
        notes.push(format!("line {first_line} is taken for a header"));
    }
    let times_s = at.filter(|_| is_time).map(|at| rows.chunks_exact(columns).map(|row| scale * row[at]).collect());
    let values: Vec<f64> = match at {
        None => rows,
        Some(at) => {
            let beside =
                |row: &[f64]| row.iter().enumerate().filter(|(k, _)| *k != at).map(|(_, v)| *v).collect::<Vec<_>>();
            rows.chunks_exact(columns).flat_map(beside).collect()
        }
    };
    let columns = columns - usize::from(at.is_some());
    Ok(FrameArray { shape: vec![values.len() / columns.max(1), columns], values, times_s, rate_hz: None, notes })
}

/// The number in a field; NaN for an empty one.
fn number(field: &str) -> Option<f64> {
    match field.to_lowercase().as_str() {
        "" | "nan" | "na" | "null" | "none" => Some(f64::NAN),
        _ => field.parse::<f64>().ok(),
    }
}

/// Whether the fields of a first line are names: words and at most the numbers of columns, in order.
fn is_header(fields: &[String]) -> bool {
    let numbers: Vec<f64> = fields.iter().filter(|f| !f.is_empty()).filter_map(|f| number(f)).collect();
    let words = fields.iter().filter(|f| number(f).is_none() && !is_decimal_comma(f)).count();
    let counted = |from: f64| numbers.iter().zip(0..).all(|(v, k)| (v - from - f64::from(k)).abs() < 1e-9);
    let unnamed = fields.iter().any(String::is_empty);
    match numbers.len() {
        0 => words > 0,
        _ => (words > 0 || unnamed) && (counted(0.0) || counted(1.0)) && numbers.len() > 1,
    }
}

/// Whether a field is a number with a decimal comma, or the two halves of several.
fn is_decimal_comma(field: &str) -> bool {
    let digits = |text: &str| !text.is_empty() && text.chars().all(|c| c.is_ascii_digit());
    let whole = |text: &str| digits(text.trim_start_matches(['-', '+']));
    let of_one =
        |(before, after): (&str, &str)| whole(before) && digits(after.split(['e', 'E']).next().unwrap_or_default());
    field.split_whitespace().count() > 1 && field.split_whitespace().all(whole)
        || field.split_once(',').is_some_and(of_one)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str, taxels: usize) -> Result<FrameArray, String> {
        table(text, taxels).map_err(|refusal| refusal.to_string())
    }

    #[test]
    fn tables_of_any_kind() {
        let plain = FrameArray { shape: vec![2, 2], values: vec![1.0, 2.5, 3.0, -4.0], ..FrameArray::default() };
        for text in [
            "1,2.5\n3,-4\n",
            "1; 2.5\r\n3; -4",
            "1\t2.5\n3\t-4\n",
            "1 2.5\n  3   -4\n",
            "a,b\n1,2.5\n3,-4\n",
            "# remark\n\"a\",\"b\",\n1,2.5,\n3,-4,\n",
            "index,0,1\n0,1,2.5\n1,3,-4\n",
        ] {
            let found = of(text, 2).unwrap();
            assert_eq!(
                (found.shape, found.values, found.times_s),
                (plain.shape.clone(), plain.values.clone(), None),
                "{text:?}"
            );
        }
        // a tab at the end is a missing value
        assert!(of("1\t2\n3\t\n", 2).unwrap().values[3].is_nan());
        let timed = FrameArray { times_s: Some(vec![0.0, 0.02]), ..plain.clone() };
        for text in ["time_ms,a,b\n0,1,2.5\n20,3,-4\n", "a,b,Time (s)\n1,2.5,0\n3,-4,0.02\n"] {
            assert_eq!(of(text, 2).unwrap(), timed, "{text:?}");
        }
        let taken = of("0,1,2.5\n0.02,3,-4\n", 2).unwrap();
        assert_eq!((taken.times_s, taken.values, taken.notes.len()), (timed.times_s, plain.values.clone(), 1));
        assert!(of("1,nan\n,2\n", 2).unwrap().values[1..3].iter().all(|v| v.is_nan()));
        for (text, said) in [
            ("1,5;2,5\n3,5;4,5\n", "line 1: `1,5` has a decimal comma"),
            ("1,5 2,5\n3,5 4,5\n", "has a decimal comma"),
            ("1,2\n3\n", "line 2: 1 values; 2 are in the lines before"),
            ("1,2\n3,x\n", "line 2: `x` is not a number"),
            ("1,x,3\n4,5,6\n", "line 1: `x` is not a number"),
            ("a,b,time\n4,5\n", "line 2: 2 values; 3 names are in the header"),
            ("1,2\n3,inf\n", "line 2: `inf` is not finite"),
            ("a,b\n", "holds no numbers"),
            ("", "holds no numbers"),
        ] {
            let found = of(text, 2).unwrap_err();
            assert!(found.contains(said), "{text:?}: {found}");
        }
    }

    /// An archive of NumPy: the frames by their usual name, with the time between them.
    #[test]
    fn archives() {
        use std::io::Write as _;
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.npz");
        let pack = |names: &[&str]| {
            let mut archive = zip::ZipWriter::new(std::fs::File::create(&path).unwrap());
            for name in names {
                let array = dir.path().join("one.npy");
                let scalar = *name == "frame_s";
                let (shape, values) = if scalar { (vec![], vec![0.02]) } else { (vec![3, 2], vec![1.0; 6]) };
                crate::output::write_npy(&array, &shape, &values).unwrap();
                archive.start_file(format!("{name}.npy"), zip::write::SimpleFileOptions::default()).unwrap();
                archive.write_all(&std::fs::read(&array).unwrap()).unwrap();
            }
            archive.finish().unwrap();
        };
        pack(&["frames", "frame_s", "other"]);
        let found = FrameArray::read(&path, None, 2).unwrap();
        assert_eq!((found.shape, found.rate_hz), (vec![3, 2], Some(50.0)));
        assert_eq!(FrameArray::read(&path, Some("other"), 2).unwrap().values, [1.0; 6]);
        let said = FrameArray::read(&path, Some("none"), 2).unwrap_err().to_string();
        assert!(said.contains("a.npz: no array `none`? it has ") && said.contains("--variable"), "{said}");
        pack(&["first", "second"]);
        let said = FrameArray::read(&path, None, 2).unwrap_err().to_string();
        assert!(said.contains("which array are the frames?"), "{said}");
    }

    /// MATLAB's arrays have the first index fastest.
    #[test]
    fn arrays_of_matlab() {
        let part = |kind: u32, data: &[u8]| {
            let length = u32::try_from(data.len()).unwrap();
            let mut part = [&kind.to_le_bytes()[..], &length.to_le_bytes(), data].concat();
            part.resize(part.len().next_multiple_of(8), 0);
            part
        };
        let doubles = |values: &[f64]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
        let matrix = |name: &str, shape: [i32; 2], values: &[f64]| {
            let shape: Vec<u8> = shape.iter().flat_map(|side| side.to_le_bytes()).collect();
            let flags = [6_u32.to_le_bytes(), [0; 4]].concat();
            part(14, &[part(6, &flags), part(5, &shape), part(1, name.as_bytes()), part(9, &doubles(values))].concat())
        };
        let mut header = vec![b' '; 128];
        header[124..].copy_from_slice(&[0, 1, b'I', b'M']);
        let times = matrix("time_s", [3, 1], &[0.0, 0.5, 1.0]);
        let all = matrix("touch", [3, 2], &[1.0, 2.0, 3.0, 10.0, 20.0, 30.0]);
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.mat");
        std::fs::write(&path, [header, times, all].concat()).unwrap();
        for variable in [None, Some("touch")] {
            let found = FrameArray::read(&path, variable, 4).unwrap();
            assert_eq!((found.shape, found.values), (vec![3, 2], vec![1.0, 10.0, 2.0, 20.0, 3.0, 30.0]));
            assert_eq!(found.times_s, Some(vec![0.0, 0.5, 1.0]));
        }
        let said = FrameArray::read(&path, Some("none"), 4).unwrap_err().to_string();
        assert!(said.contains("no variable `none` (found: time_s (double), touch (double))"), "{said}");
    }

    /// NumPy's types and orders, written by a writer of its own.
    #[test]
    fn arrays_of_any_type() {
        use npyz::WriterBuilder as _;
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.npy");
        for order in [Order::C, Order::Fortran] {
            let mut bytes = Vec::new();
            let options = npyz::WriteOptions::new().default_dtype().shape(&[2, 3]).order(order);
            let mut writer = options.writer(&mut bytes).begin_nd().unwrap();
            writer.extend([1_u16, 2, 3, 4, 5, 1023]).unwrap();
            writer.finish().unwrap();
            std::fs::write(&path, bytes).unwrap();
            let found = FrameArray::read(&path, None, 3).unwrap();
            let values = if order == Order::C { [1, 2, 3, 4, 5, 1023] } else { [1, 3, 5, 2, 4, 1023] };
            assert_eq!((found.shape, found.values), (vec![2, 3], values.map(f64::from).to_vec()));
        }
        std::fs::write(&path, "no array").unwrap();
        assert!(FrameArray::read(&path, None, 3).unwrap_err().to_string().contains("not a readable NumPy array"));
        let said = FrameArray::read(&dir.path().join("a.xlsx"), None, 3).unwrap_err().to_string();
        assert!(said.contains("a.xlsx: is not a file of frames; valid: .npy"), "{said}");
    }
}
