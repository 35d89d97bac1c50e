//! Frames of any skin or simulator: what every taxel shows, time after time. They come from a file or an array and
//! make a session with a raster recording.

use super::mat::read_mat_array;
use crate::session::{Event, NAMES, PressFacts, Recorded, Session, is_plain};
use npyz::{DType, NpyFile, Order, TypeChar};
use spts_circuit::{Block, FrameUnit, Recording, RecordingInfo, Seeding, WeightMode, Weights};
use spts_input::Refusal;
use spts_models::{ConductanceMap, PressureMap, SkinLayout, in_interval};
use spts_recon::metrics::median;
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

/// Frames of a sheet of taxels, press after press.
///
/// ```
/// use spts::data::{FrameArray, FrameOptions, Frames};
/// use spts::{FrameUnit, SkinLayout};
///
/// let layout = SkinLayout::with_pitch(2, 3, 0.01)?;
/// let values = (0..5 * 6).map(|k| f64::from(k / 6 * (k % 6))).collect();
/// let array = FrameArray { shape: vec![5, 2, 3], values, ..FrameArray::default() };
/// let frames = Frames::new(array, [2, 3], None)?;
/// let options = FrameOptions { rate_hz: Some(50.0), ..FrameOptions::new("mine", layout, FrameUnit::Relative) };
/// let (session, _) = frames.session(&options)?;
/// assert_eq!(Frames::of_session(&session)?.values(), frames.values());
/// # Ok::<(), spts::Refusal>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Frames {
    shape: [usize; 4],
    values: Vec<f64>,
    times_s: Option<Vec<f64>>,
    rate_hz: Option<f64>,
    notes: Vec<String>,
}

/// A contact: in which run of frames, its first frame, and the numbers of frames before it and of its own.
struct Contact {
    run: usize,
    start: usize,
    idle: usize,
    held: usize,
}

/// What is known of frames beside their values.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameOptions {
    /// Name of the session.
    pub name: String,
    /// What was pressed.
    pub object: String,
    /// The skin.
    pub layout: SkinLayout,
    /// Unit of the values.
    pub unit: FrameUnit,
    /// Frames a second; `None` for those that the file says.
    pub rate_hz: Option<f64>,
    /// Frames at the start of every press in which nothing touches the skin; `None` to find them.
    pub idle: Option<usize>,
    /// Span of a press in which the contact is steady, s; `None` to find it.
    pub hold_s: Option<[f64; 2]>,
}

impl FrameOptions {
    /// Frames called `name` on a skin with this `layout`, with everything else found or as the file says it.
    pub fn new(name: &str, layout: SkinLayout, unit: FrameUnit) -> Self {
        let name = name.to_owned();
        Self { object: name.clone(), name, layout, unit, rate_hz: None, idle: None, hold_s: None }
    }
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
        let name = names.iter().find(|name| *name != chosen && known.contains(&name.as_str()));
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

/// Where the taxels are among the dimensions of an array, and the sizes of the others.
enum TaxelOrder {
    /// Last: (presses, frames, taxels).
    Behind(Vec<usize>),
    /// First: (taxels, frames, presses).
    Before(Vec<usize>),
    /// Two dimensions, of which the first has the rows of all frames one below the other.
    Stacked(usize),
}

/// The order of an array of this `shape` for a `sheet` of rows and columns, and whether it fits in another way too.
fn order_of(shape: &[usize], sheet: &[usize], [rows, cols]: [usize; 2]) -> Option<(TaxelOrder, bool)> {
    let flat = [rows * cols];
    let most = |outer: &&[usize]| outer.len() <= 2;
    let behind = shape.strip_suffix(sheet).or_else(|| shape.strip_suffix(&flat)).filter(most);
    let before = shape.strip_prefix(sheet).or_else(|| shape.strip_prefix(&flat)).filter(most);
    let before = before.filter(|outer| !outer.is_empty() && *outer != [1]);
    let stacked = match shape {
        [lines, columns] if *columns == cols && rows > 1 && lines % rows == 0 && *lines > rows => Some(lines / rows),
        _ => None,
    };
    match (behind, stacked, before) {
        (Some(outer), _, before) => Some((TaxelOrder::Behind(outer.to_vec()), before.is_some())),
        (None, Some(frames), before) => Some((TaxelOrder::Stacked(frames), before.is_some())),
        (None, None, before) => Some((TaxelOrder::Before(before?.to_vec()), false)),
    }
}

impl TaxelOrder {
    /// Sizes of the other dimensions, presses before frames, and the values with the taxels last.
    fn sorted(self, values: Vec<f64>, taxels: usize) -> (Vec<usize>, Vec<f64>) {
        match self {
            Self::Behind(outer) => (outer, values),
            Self::Stacked(frames) => (vec![frames], values),
            Self::Before(outer) => {
                let count: usize = outer.iter().product();
                let of = |frame: usize| (0..taxels).map(move |taxel| taxel * count + frame);
                let order: Vec<usize> = match outer[..] {
                    [frames, presses] => (0..presses).flat_map(|p| (0..frames).map(move |f| f * presses + p)).collect(),
                    _ => (0..count).collect(),
                };
                let sorted = order.into_iter().flat_map(of).map(|at| values[at]).collect();
                (outer.into_iter().rev().collect(), sorted)
            }
        }
    }
}

/// Most rows and columns of taxels.
const MOST_SIDE: usize = 1 << 16;

impl Frames {
    /// Frames of a sheet of rows × cols taxels from `array`, of a shape like (presses, frames, rows, cols), (frames,
    /// rows, cols), (frames, rows · cols), or with rows and cols in front, as MATLAB's users have them. `press_frames`
    /// cuts one run of frames into presses.
    ///
    /// # Errors
    /// [`Refusal`] if the shape does not fit the sheet, or a value is infinite.
    pub fn new(array: FrameArray, [rows, cols]: [usize; 2], press_frames: Option<usize>) -> Result<Self, Refusal> {
        let FrameArray { shape, values, times_s, rate_hz, mut notes } = array;
        for (field, side) in [("rows", rows), ("cols", cols)] {
            if !(1..=MOST_SIDE).contains(&side) {
                return Err(Refusal::range(field, side, format!("[1, {MOST_SIDE}]")));
            }
        }
        let taxels = rows * cols;
        let count = shape.iter().try_fold(1_usize, |n, side| n.checked_mul(*side));
        if count != Some(values.len()) {
            return Err(Refusal::new(format!("shape {shape:?} is not that of {} values", values.len())));
        }
        if let Some(at) = values.iter().position(|v| v.is_infinite()) {
            return Err(Refusal::new(format!("value {at} = {} is not finite", values[at])));
        }
        if values.is_empty() {
            return Err(Refusal::new("holds no frames"));
        }
        let needed = format!("(frames, {rows}, {cols}), (presses, frames, {rows}, {cols}) or (frames, {taxels})");
        let unfit = format!("shape {shape:?} is not that of frames of {rows} × {cols} taxels: {needed}");
        let squeezed: Vec<usize> = shape.iter().copied().filter(|side| *side != 1).collect();
        let sheet: Vec<usize> = [rows, cols].into_iter().filter(|side| *side != 1).collect();
        // as it is, before sides of 1 are left out
        let (order, others) = order_of(&shape, &[rows, cols], [rows, cols])
            .or_else(|| order_of(&squeezed, &sheet, [rows, cols]))
            .ok_or_else(|| Refusal::new(unfit.clone()))?;
        let taken = match &order {
            TaxelOrder::Behind(_) => "the first dimension is taken for the frames",
            TaxelOrder::Stacked(_) => "every frame is taken for as many lines as there are rows",
            TaxelOrder::Before(_) => "the last dimension is taken for the frames",
        };
        match &order {
            _ if others => notes.push(format!("shape {shape:?} fits in two ways: {taken}")),
            TaxelOrder::Stacked(_) => notes.push(format!("{cols} columns: {taken}")),
            _ => {}
        }
        let (outer, values) = order.sorted(values, taxels);
        let (mut presses, mut frames) = match outer[..] {
            [] => (1, 1),
            [frames] => (1, frames),
            [presses, frames] => (presses, frames),
            _ => return Err(Refusal::new(unfit)),
        };
        if let Some(each) = press_frames {
            let all = presses * frames;
            if each == 0 || !all.is_multiple_of(each) {
                let range = format!("the divisors of {all}, the number of frames");
                return Err(Refusal::range("--press-frames", each, range));
            }
            (presses, frames) = (all / each, each);
        }
        let times_s = times_s.filter(|times| {
            let fits = times.len() == frames || times.len() == presses * frames;
            if !fits {
                notes.push(format!("{} times for {frames} frames: they are left out", times.len()));
            }
            fits
        });
        for (press, times) in times_s.iter().flat_map(|times| times.chunks(frames)).enumerate() {
            if let Some(at) = times
                .windows(2)
                .position(|pair| !matches!(pair[0].partial_cmp(&pair[1]), Some(std::cmp::Ordering::Less)))
            {
                let (frame, before, after) = (at + 1, times[at], times[at + 1]);
                let problem = format!("time of frame {frame} = {after} s is not behind that before, {before} s");
                return Err(Refusal::new(format!("press {press}: {problem}")));
            }
        }
        Ok(Self { shape: [presses, frames, rows, cols], values, times_s, rate_hz, notes })
    }

    /// A press for every contact in the frames: from some idle frames before its onset on, all equally long. A contact
    /// lasts while the sum of the taxels is above its least value by more than 15 % of what it rises in the run of
    /// frames. Left out are contacts whose begin is not in the frames, and those shorter than half the usual one.
    ///
    /// # Errors
    /// [`Refusal`] if there is no whole contact.
    pub fn cut(self) -> Result<Self, Refusal> {
        let mut contacts: Vec<Contact> = Vec::new();
        let mut without_begin = 0;
        for (run, sums) in self.sums().iter().enumerate() {
            let (least, most) = ends(sums);
            let is_held = |k: &usize| sums[*k] > least + TOUCHED * (most - least);
            let mut at = 0;
            while at < sums.len() {
                let idle = (at..sums.len()).take_while(|k| !is_held(k)).count();
                let start = at + idle;
                let held = (start..sums.len()).take_while(is_held).count();
                match (idle, held) {
                    (_, 0) => {}
                    (0, _) => without_begin += 1,
                    _ => contacts.push(Contact { run, start, idle, held }),
                }
                at = start + held.max(1);
            }
        }
        let mut lengths: Vec<usize> = contacts.iter().map(|contact| contact.held).collect();
        lengths.sort_unstable();
        let usual = lengths.get(lengths.len() / 2).copied().unwrap_or(0);
        let found = contacts.len();
        contacts.retain(|c| 2 * c.held >= usual && c.held >= FEWEST_HELD && c.idle >= FEWEST_IDLE);
        let (Some(idle), Some(held)) = (contacts.iter().map(|c| c.idle).min(), contacts.iter().map(|c| c.held).min())
        else {
            let needed = format!("{FEWEST_IDLE} frames without a touch, then {FEWEST_HELD} of a contact");
            return Err(Refusal::new(format!("--cut: no contact is whole: {needed} are needed")));
        };
        let idle = idle.min(held);
        let [_, _, rows, cols] = self.shape;
        let frames = contacts.iter().flat_map(|c| self.press(c.run).skip(c.start - idle).take(idle + held).flatten());
        let values = frames.copied().collect();
        let mut notes = self.notes.clone();
        let (count, left_out) = (contacts.len(), found + without_begin - contacts.len());
        let cut = format!("from {idle} frames before its onset to {held} frames behind it");
        notes.push(format!("{count} contacts, each {cut}; left out, as not whole: {left_out}"));
        let times_s = self.times_s.as_ref().map(|times| {
            // one time a frame of every run, or those of all runs
            let run = if times.len() == self.shape[1] { 0 } else { self.shape[1] };
            contacts.iter().flat_map(|c| times[c.run * run + c.start - idle..][..idle + held].iter().copied()).collect()
        });
        Ok(Self { shape: [count, idle + held, rows, cols], values, times_s, rate_hz: self.rate_hz, notes })
    }

    /// Presses, frames of a press, rows and columns.
    pub fn shape(&self) -> [usize; 4] {
        self.shape
    }

    /// All values, last dimension fastest.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Time of every frame, s: press after press, or once for all; `None` if it is not known.
    pub fn times_s(&self) -> Option<&[f64]> {
        self.times_s.as_deref()
    }

    fn taxels(&self) -> usize {
        self.shape[2] * self.shape[3]
    }

    /// The frames of press number `press`.
    fn press(&self, press: usize) -> std::slice::ChunksExact<'_, f64> {
        let length = self.shape[1] * self.taxels();
        self.values[press * length..][..length].chunks_exact(self.taxels())
    }

    /// The frames of a session's raster scan, in the unit in which it was taken.
    ///
    /// # Errors
    /// [`Refusal`] if it has none.
    pub fn of_session(session: &Session) -> Result<Self, Refusal> {
        let raster = session.raster().ok_or_else(|| Refusal::new("has no frames: `raster` is null"))?;
        let layout = raster.layout();
        let shape = [raster.blocks().len(), raster.frames(), layout.rows(), layout.cols()];
        let rate_hz = raster.sample_rate_hz() / raster.measurements_per_frame() as f64;
        let values = raster.blocks().iter().flat_map(|block| block.volts.iter().copied()).collect();
        Ok(Self { shape, values, times_s: None, rate_hz: Some(rate_hz), notes: Vec::new() })
    }

    /// A session with these frames as its raster recording, and what was found or taken for granted.
    ///
    /// # Errors
    /// [`Refusal`] if something is out of range, the rate is not known, or the shape is another than the layout's.
    pub fn session(&self, options: &FrameOptions) -> Result<(Session, Vec<String>), Refusal> {
        let FrameOptions { layout, unit, .. } = options;
        let [presses, frames, rows, cols] = self.shape;
        if !is_plain(&options.name) {
            return Err(Refusal::range("name", format!("{:?}", options.name), NAMES));
        }
        if [layout.rows(), layout.cols()] != [rows, cols] {
            return Err(Refusal::new(format!("frames of {rows} × {cols} taxels are not those of the layout")));
        }
        let mut notes = self.notes.clone();
        let rate_hz = self.rate(options, &mut notes)?;
        let sums = self.sums();
        let idle = match options.idle {
            Some(idle) if idle > frames => {
                return Err(Refusal::range("--idle", format!("first:{idle}"), format!("[0, {frames}] frames")));
            }
            Some(idle) => Some(idle),
            None => self.found_idle(&sums, &mut notes),
        };
        let hold_s = match options.hold_s {
            Some([start_s, end_s]) => {
                let most_s = frames as f64 / rate_hz;
                let least_s = 1.0 / rate_hz;
                let long = end_s - start_s >= least_s * (1.0 - 1e-6);
                if !(0.0 <= start_s && long && end_s <= most_s * (1.0 + 1e-9)) {
                    let range = format!("the spans of at least a frame, {least_s} s, within [0, {most_s}] s");
                    return Err(Refusal::range("--hold", format!("{start_s}:{end_s}"), range));
                }
                [start_s, end_s]
            }
            None => found_hold(&sums, frames, rate_hz, &mut notes),
        };
        self.broken(idle.unwrap_or(0), &mut notes);
        let taxels = u32::try_from(self.taxels()).unwrap_or(u32::MAX);
        let weights = Weights::new(WeightMode::Raster, Seeding::Address, taxels);
        let mut info = RecordingInfo::new(*layout, weights, rate_hz * self.taxels() as f64);
        info.unit = Some(*unit);
        let block = |press: usize| Block {
            frame_position: ((press + 1) * frames) as u64,
            idle_frames: idle,
            volts: self.press(press).flatten().copied().collect(),
        };
        let recording = Recording::new(info, (0..presses).map(block).collect())?;
        let facts = (0..presses).map(|press| self.facts(press, *unit, idle, hold_s, rate_hz));
        let facts: Vec<PressFacts> = facts.collect();
        let known = facts.iter().filter(|f| f.pressure.is_some() || f.conductance.is_some()).count();
        if known < presses && matches!(unit, FrameUnit::Pressure | FrameUnit::Conductance) {
            notes.push(format!("{} presses have taxels without any value in their hold", presses - known));
        }
        let session = Session {
            object: options.object.clone(),
            hold_s: Some(hold_s),
            raster: Some(Recorded { presses: facts, ..Recorded::new(recording) }),
            ..Session::new(&options.name, Event::Press)
        };
        Ok((session, notes))
    }

    fn rate(&self, options: &FrameOptions, notes: &mut Vec<String>) -> Result<f64, Refusal> {
        let steps = |times: &Vec<f64>| -> Vec<f64> {
            times.chunks(self.shape[1]).flat_map(|times| times.windows(2).map(|pair| pair[1] - pair[0])).collect()
        };
        let steps = self.times_s.as_ref().map(steps).filter(|steps| !steps.is_empty());
        let by_times = steps.map(|steps| {
            let step_s = median(&steps).unwrap_or(f64::NAN);
            let longest = steps.iter().copied().fold(0.0, f64::max);
            let shortest = steps.iter().copied().fold(f64::INFINITY, f64::min);
            if longest > 1.5 * step_s || shortest < 0.5 * step_s {
                let spread = format!("{shortest:.4} to {longest:.4} s");
                notes.push(format!("frames are {step_s:.4} s apart, but {spread}: they are taken to be evenly spaced"));
            }
            1.0 / step_s
        });
        let named = if options.rate_hz.is_some() { "--rate" } else { "frames a second of the file" };
        let Some(rate_hz) = options.rate_hz.or(by_times).or(self.rate_hz) else {
            return Err(Refusal::new("`--rate` is missing: the file does not say how many frames a second it has"));
        };
        in_interval(named, rate_hz, "[1e-3, 1e6] Hz")?;
        Ok(rate_hz)
    }

    /// Sum of every frame, press by press; a missing value counts as the mean of the others.
    fn sums(&self) -> Vec<Vec<f64>> {
        let of = |frame: &[f64]| frame.len() as f64 * mean_of(frame.iter().copied()).unwrap_or(0.0);
        (0..self.shape[0]).map(|press| self.press(press).map(of).collect()).collect()
    }

    /// Frames that begin every press before its sum has risen by a tenth of what it rises; at most those of any press.
    fn found_idle(&self, sums: &[Vec<f64>], notes: &mut Vec<String>) -> Option<usize> {
        let of = |sums: &Vec<f64>| {
            let (least, most) = ends(sums);
            sums.iter().take_while(|sum| **sum <= least + IDLE_RISE * (most - least)).count()
        };
        let found = sums.iter().map(of).min().unwrap_or(0);
        if found == self.shape[1] {
            notes.push("the frames of a press do not differ: nothing touches the skin there".to_owned());
            return None;
        }
        if found == 0 {
            let why = "presses do not begin untouched: nothing is subtracted";
            notes.push(format!("{why}; --cut makes a press of every contact, --idle first:N names idle frames"));
            return None;
        }
        notes.push(format!("idle: the first {found} frames of every press; --idle first:N says otherwise"));
        Some(found)
    }

    /// Says which taxels never change where most do, and which conduct without a touch.
    fn broken(&self, idle: usize, notes: &mut Vec<String>) {
        let taxels = self.taxels();
        let mut ranges = vec![[f64::INFINITY, f64::NEG_INFINITY]; taxels];
        let mut missing = 0_usize;
        for (value, range) in
            self.values.chunks_exact(taxels).flat_map(|frame| frame.iter().zip(0..)).map(|(v, k)| (*v, k))
        {
            if value.is_nan() {
                missing += 1;
            } else {
                ranges[range] = [ranges[range][0].min(value), ranges[range][1].max(value)];
            }
        }
        if missing > 0 {
            notes.push(format!("{missing} values are missing"));
        }
        let (least, most) =
            ranges.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, m), r| (l.min(r[0]), m.max(r[1])));
        let changing = ranges.iter().filter(|r| r[1] > r[0]).count();
        if 2 * changing < taxels {
            return;
        }
        let still = |k: &usize| ranges[*k][1] <= ranges[*k][0];
        let is_high = |k: &usize| ranges[*k][0] > least + 0.5 * (most - least);
        let dead: Vec<usize> = (0..taxels).filter(|k| still(k) && !is_high(k)).collect();
        let stuck: Vec<usize> = (0..taxels).filter(|k| still(k) && is_high(k)).collect();
        for (taxels, what) in [(dead, "never change: dead"), (stuck, "never change and are high: stuck")] {
            if !taxels.is_empty() {
                notes.push(format!("taxels that {what}: {}", self.named(&taxels)));
            }
        }
        let untouched: Vec<f64> = (0..taxels).map(|taxel| self.idle_median(taxel, idle)).collect();
        let usual = median(&untouched).unwrap_or_default();
        let loaded = |k: &usize| !still(k) && untouched[*k] - usual > LOADED * (most - usual);
        let loaded: Vec<usize> = (0..taxels).filter(loaded).collect();
        if !loaded.is_empty() {
            notes.push(format!("taxels that are high without a touch: {}", self.named(&loaded)));
        }
    }

    /// Median of a taxel in the first `idle` frames of the presses; 0 without any.
    fn idle_median(&self, taxel: usize, idle: usize) -> f64 {
        let frames = (0..self.shape[0]).flat_map(|press| self.press(press).take(idle).map(move |frame| frame[taxel]));
        median(&frames.filter(|v| v.is_finite()).collect::<Vec<_>>()).unwrap_or_default()
    }

    /// Places of taxels as (row, column), the first ones.
    fn named(&self, taxels: &[usize]) -> String {
        const MOST: usize = 12;
        let places = taxels.iter().take(MOST).map(|k| format!("({}, {})", k / self.shape[3], k % self.shape[3]));
        let places = places.collect::<Vec<_>>().join(", ");
        match taxels.len().saturating_sub(MOST) {
            0 => places,
            more => format!("{places} and {more} more"),
        }
    }

    /// What is known of a press: in the middle of its hold, the image without the idle one.
    fn facts(&self, press: usize, unit: FrameUnit, idle: Option<usize>, hold_s: [f64; 2], rate_hz: f64) -> PressFacts {
        let [start, end] = hold_s.map(|time_s| (time_s * rate_hz).round());
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within the frames")]
        let (start, end) = (start as usize, (end as usize).min(self.shape[1]));
        let mut image = self.mean(press, start..end.max(start + 1));
        let untouched = idle.filter(|idle| *idle > 0).map(|idle| self.mean(press, 0..idle));
        for (value, idle) in image.iter_mut().zip(untouched.iter().flatten()) {
            *value -= idle;
        }
        let complete = image.iter().all(|v| v.is_finite());
        image.iter_mut().for_each(|v| *v = v.max(0.0));
        let [_, _, rows, cols] = self.shape;
        let pressure =
            (unit == FrameUnit::Pressure && complete).then(|| PressureMap::from_values(rows, cols, image.clone()));
        let conductance =
            (unit == FrameUnit::Conductance && complete).then(|| ConductanceMap::from_values(rows, cols, image));
        PressFacts { time_s: Some(0.5 * (hold_s[0] + hold_s[1])), pressure, conductance, ..PressFacts::default() }
    }

    /// Mean of some frames of a press; NaN for a taxel that is missing in all of them.
    fn mean(&self, press: usize, frames: std::ops::Range<usize>) -> Vec<f64> {
        let frames: Vec<&[f64]> = self.press(press).skip(frames.start).take(frames.len()).collect();
        let of = |taxel: usize| mean_of(frames.iter().map(|frame| frame[taxel])).unwrap_or(f64::NAN);
        (0..self.taxels()).map(of).collect()
    }
}

/// Mean of the values that are not missing; `None` if all are.
fn mean_of(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.filter(|v| v.is_finite()).fold((0.0, 0_usize), |(sum, count), v| (sum + v, count + 1));
    (count > 0).then(|| sum / count as f64)
}

/// Share of its rise by which the sum of an idle frame may exceed the least.
const IDLE_RISE: f64 = 0.1;
/// Share of its rise above which the sum of the taxels is that of a contact.
const TOUCHED: f64 = 0.15;
/// Fewest frames of a contact that is cut out, and before it.
const FEWEST_HELD: usize = 3;
const FEWEST_IDLE: usize = 3;
/// Share of its rise above which the sum of a steady contact stays.
const HELD: f64 = 0.8;
/// Share of the largest value above which a taxel counts as loaded without a touch.
const LOADED: f64 = 0.1;

fn ends(values: &[f64]) -> (f64, f64) {
    values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), v| (least.min(*v), most.max(*v)))
}

/// The span in which the mean course of the presses stays at its largest.
fn found_hold(sums: &[Vec<f64>], frames: usize, rate_hz: f64, notes: &mut Vec<String>) -> [f64; 2] {
    let mean: Vec<f64> = (0..frames).map(|k| sums.iter().map(|s| s[k]).sum::<f64>() / sums.len() as f64).collect();
    let (least, most) = ends(&mean);
    let peak = (0..frames).rev().max_by(|a, b| mean[*a].total_cmp(&mean[*b])).unwrap_or(0);
    let held = |k: &usize| mean[*k] >= least + HELD * (most - least);
    let start = (0..peak).rev().take_while(held).last().unwrap_or(peak);
    let end = (peak..frames).take_while(held).last().unwrap_or(peak) + 1;
    let hold_s = [start, end].map(|k| k as f64 / rate_hz);
    notes.push(format!(
        "hold: {:.3} to {:.3} s of every press, where the sum of the taxels stays at its largest; --hold says otherwise",
        hold_s[0], hold_s[1]
    ));
    hold_s
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn of(text: &str, taxels: usize) -> Result<FrameArray, String> {
        table(text, taxels).map_err(|refusal| refusal.to_string())
    }

    fn frames(shape: &[usize], sheet: [usize; 2]) -> Result<Frames, String> {
        let count: usize = shape.iter().product();
        let values = (0..count).map(|k| k as f64).collect();
        let array = FrameArray { shape: shape.to_vec(), values, ..FrameArray::default() };
        Frames::new(array, sheet, None).map_err(|refusal| refusal.to_string())
    }

    fn options(unit: FrameUnit, [rows, cols]: [usize; 2]) -> FrameOptions {
        let layout = SkinLayout::with_pitch(rows, cols, 0.01).unwrap();
        FrameOptions { rate_hz: Some(100.0), ..FrameOptions::new("mine", layout, unit) }
    }

    proptest! {
        /// Frames are in the session's files bit for bit, whatever they are.
        #[test]
        fn frames_come_back(
            (presses, count, rows, cols) in (1_usize..4, 1_usize..6, 1_usize..5, 1_usize..5),
            bits in proptest::collection::vec(any::<f64>(), 4 * 6 * 5 * 5), unit in 0_usize..4,
        ) {
            let finite = |v: &f64| if v.is_infinite() { f64::NAN } else { *v };
            let values: Vec<f64> = bits.iter().map(finite).take(presses * count * rows * cols).collect();
            let array = FrameArray { shape: vec![presses, count, rows, cols], values, ..FrameArray::default() };
            let made = Frames::new(array.clone(), [rows, cols], None).unwrap();
            let unit = [FrameUnit::Pressure, FrameUnit::Conductance, FrameUnit::Codes, FrameUnit::Relative][unit];
            let (session, _) = made.session(&FrameOptions { hold_s: Some([0.0, 0.01]), ..options(unit, [rows, cols]) }).unwrap();
            let dir = tempfile::tempdir().unwrap();
            session.write(dir.path()).unwrap();
            let read = Session::read(dir.path()).unwrap();
            let again = Frames::of_session(&read).unwrap();
            prop_assert_eq!(again.shape(), [presses, count, rows, cols]);
            // a missing value is missing, whatever its bits
            let bits = |v: &f64| if v.is_nan() { f64::NAN.to_bits() } else { v.to_bits() };
            prop_assert!(again.values().iter().map(bits).eq(array.values.iter().map(bits)));
            prop_assert_eq!(read.raster().unwrap().info().unit, Some(unit));
        }
    }

    #[test]
    fn shapes_of_frames() {
        for (shape, sheet, found) in [
            (&[7, 2, 3][..], [2, 3], Some([1, 7, 2, 3])),
            (&[4, 7, 2, 3], [2, 3], Some([4, 7, 2, 3])),
            (&[7, 6], [2, 3], Some([1, 7, 2, 3])),
            (&[2, 3], [2, 3], Some([1, 1, 2, 3])),
            (&[2, 3, 7], [2, 3], Some([1, 7, 2, 3])),
            (&[6, 7], [2, 3], Some([1, 7, 2, 3])),
            (&[2, 3, 7, 4], [2, 3], Some([4, 7, 2, 3])),
            (&[14, 3], [2, 3], Some([1, 7, 2, 3])),
            (&[6, 3], [2, 3], Some([1, 3, 2, 3])),
            (&[5, 1, 2, 3], [2, 3], Some([5, 1, 2, 3])),
            (&[9, 1, 1], [1, 1], Some([1, 9, 1, 1])),
            (&[7, 1, 6], [1, 6], Some([1, 7, 1, 6])),
            (&[7, 5], [2, 3], None),
            (&[2, 2, 7, 2, 3], [2, 3], None),
        ] {
            assert_eq!(frames(shape, sheet).ok().map(|frames| frames.shape()), found, "{shape:?}");
        }
        // taxels first: taxel 5 of frame 2 of press 3 is at 5 · 7 · 4 + 2 · 4 + 3
        let turned = frames(&[2, 3, 7, 4], [2, 3]).unwrap();
        let found = turned.values()[(3 * 7 + 2) * 6 + 5];
        assert!((found - f64::from(5 * 7 * 4 + 2 * 4 + 3)).abs() < 1e-12, "{found}");
        // lines below one another are in the order of the file
        let stacked = frames(&[6, 3], [2, 3]).unwrap();
        assert!(stacked.values().is_sorted() && stacked.notes[0].contains("fits in two ways"), "{stacked:?}");
        let square = frames(&[6, 6], [2, 3]).unwrap();
        assert!(square.notes.iter().any(|note| note.contains("fits in two ways")), "{:?}", square.notes);
        let short = FrameArray { shape: vec![2, 6], values: vec![0.0; 6], ..FrameArray::default() };
        assert!(Frames::new(short, [2, 3], None).unwrap_err().to_string().contains("not that of 6 values"));
        assert!(frames(&[2, 6], [0, 3]).unwrap_err().contains("`rows` = 0"));
        let said = frames(&[7, 5], [2, 3]).unwrap_err();
        assert!(said.contains("shape [7, 5]") && said.contains("(frames, 6)"), "{said}");
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

    /// Two runs: the first has the end of a contact before a whole one, the second a short one and a whole one.
    #[test]
    fn contacts_are_cut_out() {
        let runs = [[9, 9, 0, 0, 0, 0, 8, 9, 9, 9, 9, 9, 0, 0, 0], [0, 0, 0, 8, 0, 0, 0, 0, 8, 9, 9, 9, 9, 9, 9]];
        let values = runs.iter().flatten().flat_map(|v| [f64::from(*v), 0.0]).collect();
        let array = FrameArray { shape: vec![2, 15, 1, 2], values, ..FrameArray::default() };
        let made = Frames::new(array, [1, 2], None).unwrap();
        let found = made.clone().cut().unwrap();
        assert_eq!(found.shape(), [2, 10, 1, 2]);
        let first: Vec<f64> = found.press(0).map(|frame| frame[0]).collect();
        assert_eq!(first, [0.0, 0.0, 0.0, 0.0, 8.0, 9.0, 9.0, 9.0, 9.0, 9.0]);
        let note = found.notes.last().unwrap();
        assert!(note.starts_with("2 contacts, each from 4 frames") && note.ends_with(": 2"), "{note}");
        let (session, _) = found.session(&options(FrameUnit::Codes, [1, 2])).unwrap();
        assert_eq!(session.raster().unwrap().blocks()[1].idle_frames, Some(4));
        let idle = Frames { values: vec![0.0; 60], ..made };
        assert!(idle.cut().unwrap_err().to_string().contains("no contact is whole"));
    }

    /// A press of 2 × 2 taxels: idle, rise, hold, fall; one taxel is dead, one is stuck high.
    #[test]
    fn what_is_found_in_frames() {
        let course = [0.0, 0.0, 0.0, 2.0, 9.0, 10.0, 10.0, 9.8, 3.0, 0.0];
        let frames_of = |course: &[f64]| {
            let taxel = |k: usize, load: f64| match k {
                0 => 0.0,
                1 => 12.0,
                _ => load + 0.1 * k as f64,
            };
            let values = course.iter().flat_map(|load| (0..6).map(|k| taxel(k, *load))).collect();
            FrameArray { shape: vec![course.len(), 2, 3], values, ..FrameArray::default() }
        };
        let array = frames_of(&course);
        let (session, notes) =
            Frames::new(array, [2, 3], None).unwrap().session(&options(FrameUnit::Pressure, [2, 3])).unwrap();
        let block = &session.raster().unwrap().blocks()[0];
        assert_eq!((block.idle_frames, session.hold_s), (Some(3), Some([0.04, 0.08])));
        for said in ["dead: (0, 0)", "stuck: (0, 1)", "idle: the first 3 frames", "hold: 0.040 to 0.080 s"] {
            assert!(notes.iter().any(|note| note.contains(said)), "{said}: {notes:?}");
        }
        // a missing value moves nothing
        let mut missing = frames_of(&course);
        missing.values[5 * 6 + 3] = f64::NAN;
        let (again, _) =
            Frames::new(missing, [2, 3], None).unwrap().session(&options(FrameUnit::Pressure, [2, 3])).unwrap();
        assert_eq!(again.hold_s, session.hold_s);
        assert!(again.raster.unwrap().presses[0].pressure.is_some());
        // the mean of the hold without the idle frames
        let pressure = session.raster.unwrap().presses[0].pressure.clone().unwrap();
        assert!((pressure.values()[2] - 9.7).abs() < 1e-12 && pressure.values()[1] == 0.0, "{pressure:?}");
    }

    #[test]
    fn what_cannot_be_is_refused() {
        let options = options(FrameUnit::Relative, [2, 3]);
        let told =
            |options: &FrameOptions| frames(&[7, 2, 3], [2, 3]).unwrap().session(options).unwrap_err().to_string();
        for (options, said) in [
            (FrameOptions { rate_hz: None, ..options.clone() }, "`--rate` is missing"),
            (FrameOptions { rate_hz: Some(f64::NAN), ..options.clone() }, "`--rate` = NaN is outside"),
            (FrameOptions { idle: Some(8), ..options.clone() }, "`--idle` = first:8 is outside [0, 7]"),
            (FrameOptions { hold_s: Some([0.0, 0.2]), ..options.clone() }, "`--hold` = 0:0.2 is outside"),
            (FrameOptions { hold_s: Some([0.02, 0.021]), ..options.clone() }, "of at least a frame"),
            (FrameOptions { name: "a/b".to_owned(), ..options.clone() }, "`name` = \"a/b\""),
        ] {
            assert!(told(&options).contains(said), "{said}: {}", told(&options));
        }
        let array = |times: Vec<f64>| FrameArray {
            shape: vec![2, 6],
            values: vec![0.0; 12],
            times_s: Some(times),
            ..FrameArray::default()
        };
        let said = Frames::new(array(vec![0.1, 0.1]), [2, 3], None).unwrap_err().to_string();
        assert!(said.contains("time of frame 1 = 0.1 s"), "{said}");
        let many = Frames::new(array(vec![0.0, 1.0, 2.0]), [2, 3], None).unwrap();
        assert!(many.times_s().is_none() && many.notes[0].contains("3 times for 2 frames"));
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
