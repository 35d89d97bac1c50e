//! Frames of any skin or simulator: what every taxel shows, time after time. They come from a file or an array and
//! make a session with a raster recording.

use super::frame_files::FrameArray;
use crate::session::{Event, NAMES, PressFacts, Recorded, Session, is_plain};
use spts_circuit::{Block, FrameUnit, Recording, RecordingInfo, Seeding, WeightMode, Weights};
use spts_input::Refusal;
use spts_models::{ConductanceMap, PressureMap, SkinLayout, in_interval};
use spts_recon::metrics::median;

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
    /// Frames before the contact of every press, if they have been cut so.
    idle: Option<usize>,
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
        Ok(Self { shape: [presses, frames, rows, cols], values, times_s, rate_hz, idle: None, notes })
    }

    /// A press for every contact in the frames: from some idle frames before its onset on, all equally long. The sums
    /// of the taxels in a run of frames have two levels, without and with a touch. A contact begins where the sum
    /// leaves the lower one by more than 15 % of the difference and reaches half of it, and ends below a quarter. Left
    /// out are touches that do not reach half of it, contacts whose begin is not in the frames, those shorter than half
    /// the usual one, and runs in which the levels differ by less than a quarter of what they do at most.
    ///
    /// # Errors
    /// [`Refusal`] if there is no whole contact.
    pub fn cut(self) -> Result<Self, Refusal> {
        let mut contacts: Vec<Contact> = Vec::new();
        let (mut without_begin, mut light) = (0, 0);
        let sums = self.sums();
        let rises: Vec<f64> = sums.iter().map(|sums| levels(sums)).map(|[low, high]| high - low).collect();
        let most = rises.iter().copied().fold(0.0, f64::max);
        let without_touch = rises.iter().filter(|rise| **rise <= LEAST_RISE * most).count();
        for (run, sums) in sums.iter().enumerate().filter(|(run, _)| rises[*run] > LEAST_RISE * most) {
            let [low, high] = levels(sums);
            let above = |share: f64| move |k: &usize| sums[*k] > low + share * (high - low);
            let is_touched = |sum: f64| sum > low + LEFT * (high - low);
            let light_in = |from: usize, to: usize| {
                let runs = sums.get(from..to).unwrap_or_default().chunk_by(|a, b| is_touched(*a) == is_touched(*b));
                runs.filter(|run| run.len() >= FEWEST_HELD && is_touched(run[0])).count()
            };
            let mut at = 0;
            while let Some(reached) = (at..sums.len()).find(above(REACHED)) {
                let rising = (at..reached).rev().take_while(above(TOUCHED)).count();
                let start = reached - rising;
                light += light_in(at, start);
                let idle = (at..start).rev().take_while(|k| !above(TOUCHED)(k)).count();
                let held = rising + (reached..sums.len()).take_while(above(LEFT)).count();
                if idle == 0 {
                    without_begin += 1;
                } else {
                    contacts.push(Contact { run, start, idle, held });
                }
                at = start + held;
            }
            light += light_in(at, sums.len());
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
        if light > 0 {
            notes.push(format!("light touches left out, whose sum does not reach half of the usual rise: {light}"));
        }
        if without_touch > 0 {
            notes.push(format!("runs of frames in which nothing touches the skin: {without_touch}"));
        }
        let times_s = self.times_s.as_ref().map(|times| {
            // one time a frame of every run, or those of all runs
            let run = if times.len() == self.shape[1] { 0 } else { self.shape[1] };
            contacts.iter().flat_map(|c| times[c.run * run + c.start - idle..][..idle + held].iter().copied()).collect()
        });
        // the last idle frame may have been taken while the contact began
        let shape = [count, idle + held, rows, cols];
        Ok(Self { shape, values, times_s, rate_hz: self.rate_hz, idle: Some(idle - 1), notes })
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
        Ok(Self { shape, values, times_s: None, rate_hz: Some(rate_hz), idle: None, notes: Vec::new() })
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
            let [low, high] = levels(sums);
            sums.iter().take_while(|sum| **sum <= low + IDLE_RISE * (high - low)).count()
        };
        if let Some(idle) = self.idle {
            return Some(idle);
        }
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
        if falls(&ranges) {
            notes.push(
                "values seem to fall with the load: most taxels stay at the upper end of those that change. Larger \
                 values are taken for more load; turn yours before the import, as largest value − value"
                    .to_owned(),
            );
        }
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

/// Share of its rise by which the sum of an idle frame may exceed the lower level.
const IDLE_RISE: f64 = 0.1;
/// Shares of its rise: above the first the sum of the taxels leaves the lower level, at the second it is that of a
/// contact, below the third no longer.
const TOUCHED: f64 = 0.15;
const REACHED: f64 = 0.5;
const LEFT: f64 = 0.25;
/// Least rise of a run with a contact, as a share of the largest one.
const LEAST_RISE: f64 = 0.25;
/// Fewest frames of a contact that is cut out, and before it.
const FEWEST_HELD: usize = 3;
const FEWEST_IDLE: usize = 3;
/// Share of its rise above which the sum of a steady contact stays.
const HELD: f64 = 0.85;
/// Share of the largest value above which a taxel counts as loaded without a touch.
const LOADED: f64 = 0.1;

fn ends(values: &[f64]) -> (f64, f64) {
    values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), v| (least.min(*v), most.max(*v)))
}

/// Whether values fall with the load, by the least and the largest one of every taxel: most taxels then hardly change,
/// and stay where those that change most begin to fall. Not told where the still ones differ much among themselves.
fn falls(ranges: &[[f64; 2]]) -> bool {
    let known = || ranges.iter().filter(|[least, most]| least <= most);
    let wide = known().map(|[least, most]| most - least).fold(0.0, f64::max);
    let mut still: Vec<f64> = known().filter(|r| r[1] - r[0] < 0.25 * wide).map(|r| 0.5 * (r[0] + r[1])).collect();
    let moving: Vec<&[f64; 2]> = known().filter(|r| r[1] - r[0] > 0.5 * wide).collect();
    let [lower, upper] = [0, 1].map(|end| median(&moving.iter().map(|r| r[end]).collect::<Vec<_>>()));
    let (Some(lower), Some(upper), Some(middle)) = (lower, upper, median(&still)) else { return false };
    still.sort_by(f64::total_cmp);
    let spread = still[3 * still.len() / 4] - still[still.len() / 4];
    // a single one that moves may be a dropped sample
    let enough = 2 * still.len() >= ranges.len() && moving.len() > 1;
    enough && spread < 0.5 * (upper - lower) && upper - middle < middle - lower
}

/// The levels of `values`, which come from two groups: the median of each. The groups are those that differ most for
/// their sizes (N. Otsu, IEEE Trans. Syst. Man Cybern. 9 (1979) 62).
fn levels(values: &[f64]) -> [f64; 2] {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let total: f64 = sorted.iter().sum();
    let (mut below, mut best) = (0.0, (0.0, sorted.len()));
    for split in 1..sorted.len() {
        below += sorted[split - 1];
        let (low, high) = (split as f64, (sorted.len() - split) as f64);
        let apart = low * high * ((total - below) / high - below / low).powi(2);
        if apart > best.0 {
            best = (apart, split);
        }
    }
    let (low, high) = sorted.split_at(best.1);
    let low_level = median(low).unwrap_or(0.0);
    [low_level, median(high).unwrap_or(low_level)]
}

/// The longest span in which the mean course of the presses stays at its largest.
fn found_hold(sums: &[Vec<f64>], frames: usize, rate_hz: f64, notes: &mut Vec<String>) -> [f64; 2] {
    let mean: Vec<f64> = (0..frames).map(|k| sums.iter().map(|s| s[k]).sum::<f64>() / sums.len() as f64).collect();
    let (least, most) = ends(&mean);
    let held = |k: &usize| mean[*k] >= least + HELD * (most - least);
    let (mut hold, mut at) = (0..0, 0);
    while let Some(start) = (at..frames).find(held) {
        at = start + (start..frames).take_while(held).count();
        if at - start > hold.len() {
            hold = start..at;
        }
    }
    let hold = if hold.is_empty() { 0..1 } else { hold };
    let hold_s = [hold.start, hold.end].map(|k| k as f64 / rate_hz);
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

    /// Four touches of two taxels of 6 × 6, one of them light; `of` makes a value of a load from 0 to 1.
    fn touched(of: fn(f64) -> f64) -> Frames {
        const LOADS: [f64; 4] = [0.8, 1.0, 0.3, 0.9];
        let load = |frame: usize, taxel: usize| {
            let touch = if frame % 20 < 8 { 0.0 } else { LOADS[frame / 20] };
            0.01 * ((7 * frame + 3 * taxel) % 5) as f64 + if (14..16).contains(&taxel) { touch } else { 0.0 }
        };
        let values = (0..80).flat_map(|frame| (0..36).map(move |taxel| of(load(frame, taxel)))).collect();
        Frames::new(FrameArray { shape: vec![80, 6, 6], values, ..FrameArray::default() }, [6, 6], None).unwrap()
    }

    #[test]
    fn values_that_fall_with_the_load_are_told() {
        let told = |frames: Frames| {
            let (_, notes) = frames.session(&options(FrameUnit::Codes, [6, 6])).unwrap();
            notes.iter().any(|note| note.contains("fall with the load"))
        };
        let grows = || touched(|load| 500.0 * load);
        let turned = || touched(|load| 1023.0 - 500.0 * load);
        assert!(!told(grows()) && told(turned()));
        assert!(!told(grows().cut().unwrap()) && told(turned().cut().unwrap()));
        // a dropped sample, stuck taxels under a large contact, spread offsets, a taxel without values
        let dropped = [[500.0, 700.0], [0.0, 500.0], [500.0, 505.0], [500.0, 505.0], [500.0, 505.0]];
        let stuck = [[1023.0, 1023.0], [10.0, 400.0], [5.0, 500.0], [0.0, 450.0], [9.0, 480.0]];
        let spread = [[300.0, 350.0], [250.0, 310.0], [100.0, 105.0], [380.0, 385.0], [420.0, 425.0], [440.0, 445.0]];
        let empty = [[f64::INFINITY, f64::NEG_INFINITY], [0.0, 50.0], [0.0, 60.0], [0.0, 1.0], [0.0, 1.0]];
        assert!(!falls(&dropped) && !falls(&stuck) && !falls(&spread) && !falls(&empty) && !falls(&[]));
    }

    #[test]
    fn touches_that_are_not_cut_are_counted() {
        let cut = touched(|load| load).cut().unwrap();
        assert_eq!(cut.shape()[0], 3);
        assert!(cut.notes.iter().any(|note| note.ends_with("half of the usual rise: 1")), "{:?}", cut.notes);
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
        assert_eq!(session.raster().unwrap().blocks()[1].idle_frames, Some(3));
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
}
