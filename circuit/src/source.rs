//! Conductance of the skin as a function of time.

use spts_input::Refusal;
use spts_models::ConductanceMap;

/// Largest conductance, S. A short bar of copper has 1e5; far beyond, squares would leave the range of f64.
const MAX_CONDUCTANCE_S: f64 = 1e12;

/// Conductance of every taxel during a time span in which each changes linearly.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment<'a> {
    /// Start, s since the start of the block. Not used if the conductance is constant.
    pub start_s: f64,
    /// End, s: the first instant after the segment; may be infinite if the conductance is constant.
    pub end_s: f64,
    /// Conductance of every taxel at the start, S. Range [0, 1e12].
    pub conductance_s: &'a [f64],
    /// Conductance of every taxel at the end, S, in the same range; `None` if it is constant.
    pub end_conductance_s: Option<&'a [f64]>,
    /// Fours of taxels, k for 4k to 4k + 3, outside which nothing conducts, in order; `None`: any taxel may.
    pub fours: Option<&'a [u32]>,
}

impl Segment<'_> {
    /// Checks that the segment belongs to a skin of `taxels` taxels and holds `time_s`.
    pub(crate) fn check(&self, time_s: f64, taxels: usize) -> Result<(), Refusal> {
        let len = |values: &[f64]| values.len() == taxels;
        let held = match self.end_conductance_s {
            None => true,
            Some(values) => len(values) && self.start_s <= time_s && self.end_s.is_finite(),
        };
        let there = self.fours.is_none_or(|fours| {
            fours.is_sorted_by(|a, b| a < b) && fours.last().is_none_or(|last| 4 * (*last as usize) < taxels)
        });
        if len(self.conductance_s) && held && there && time_s < self.end_s {
            return Ok(());
        }
        let (taxels, start_s, end_s) = (self.conductance_s.len(), self.start_s, self.end_s);
        let source = format!("the source gives {taxels} taxels from {start_s} s to {end_s} s");
        Err(Refusal::new(format!("at {time_s} s {source}")))
    }
}

/// Conductance of every taxel at any time of a block, as a sequence of segments.
///
/// ```
/// use spts_circuit::{ConductanceSource, Segment};
///
/// /// Four taxels that conduct more and more.
/// struct Rising {
///     start: [f64; 4],
///     end: [f64; 4],
/// }
///
/// impl ConductanceSource for Rising {
///     fn taxels(&self) -> usize {
///         4
///     }
///     fn segment(&mut self, time_s: f64) -> Segment<'_> {
///         let start_s = time_s.floor();
///         self.start = [1e-5 * start_s; 4];
///         self.end = [1e-5 * (start_s + 1.0); 4];
///         let (conductance_s, end_conductance_s) = (&self.start[..], Some(&self.end[..]));
///         Segment { start_s, end_s: start_s + 1.0, conductance_s, end_conductance_s, fours: None }
///     }
/// }
/// let mut rising = Rising { start: [0.0; 4], end: [0.0; 4] };
/// assert_eq!(rising.segment(2.5).conductance_s[0], 2e-5);
/// ```
pub trait ConductanceSource {
    /// Number of taxels.
    fn taxels(&self) -> usize;

    /// The segment that contains `time_s`, in seconds since the start of the block. The readout requests times in
    /// increasing order; of a skin on several wires for one wire after the other.
    fn segment(&mut self, time_s: f64) -> Segment<'_>;
}

/// No map, or a map without taxels.
fn empty() -> Refusal {
    Refusal::new("a conductance series needs at least one map with at least one taxel")
}

fn check(index: usize, map: &ConductanceMap, expected: usize) -> Result<(), Refusal> {
    let values = map.values();
    if values.len() != expected {
        let taxels = values.len();
        return Err(Refusal::new(format!("map {index} has {taxels} taxels; expected {expected}")));
    }
    values.iter().enumerate().try_for_each(|(taxel, value_s)| check_value(index, taxel, *value_s))
}

fn check_value(index: usize, taxel: usize, value_s: f64) -> Result<(), Refusal> {
    if (0.0..=MAX_CONDUCTANCE_S).contains(&value_s) {
        return Ok(());
    }
    Err(Refusal::new(format!("map {index}, taxel {taxel} has conductance {value_s} S, outside [0, 1e12]")))
}

/// A conductance that is constant in time.
#[derive(Debug, Clone)]
pub struct Constant {
    map: ConductanceMap,
    /// As of [`Segment::fours`].
    fours: Option<Vec<u32>>,
}

impl Constant {
    /// A source that always returns `map`.
    ///
    /// # Errors
    /// [`Refusal`] for an empty map, or a conductance outside [0, 1e12] S.
    pub fn new(map: ConductanceMap) -> Result<Self, Refusal> {
        if map.values().is_empty() {
            return Err(empty());
        }
        check(0, &map, map.values().len())?;
        Ok(Self { map, fours: None })
    }

    /// Changes the conductance of some taxels, S, and takes those for `conducting` that are not zero then: what is
    /// summed is a matter of these alone.
    ///
    /// ```
    /// use spts_circuit::Constant;
    /// use spts_models::ConductanceMap;
    ///
    /// let mut skin = Constant::new(ConductanceMap::zeros(1000, 1000))?;
    /// skin.change([(77, 1e-4), (500_000, 2e-4)], [77, 500_000])?;
    /// assert_eq!(skin.values()[77], 1e-4);
    /// # Ok::<(), spts_input::Refusal>(())
    /// ```
    ///
    /// # Errors
    /// [`Refusal`] for a conductance outside [0, 1e12] S.
    ///
    /// # Panics
    /// If there is no such taxel.
    pub fn change(
        &mut self,
        values: impl IntoIterator<Item = (usize, f64), IntoIter: Clone>,
        conducting: impl IntoIterator<Item = u32>,
    ) -> Result<(), Refusal> {
        let values = values.into_iter();
        values.clone().try_for_each(|(taxel, value_s)| check_value(0, taxel, value_s))?;
        for (taxel, value_s) in values {
            self.map.values_mut()[taxel] = value_s;
        }
        let fours = self.fours.get_or_insert_default();
        fours.clear();
        fours.extend(conducting.into_iter().map(|taxel| taxel / 4));
        fours.sort_unstable();
        fours.dedup();
        Ok(())
    }

    /// Conductance of every taxel, S.
    pub fn map(&self) -> &ConductanceMap {
        &self.map
    }

    /// Conductance of every taxel, S, row by row.
    pub fn values(&self) -> &[f64] {
        self.map.values()
    }
}

impl ConductanceSource for Constant {
    fn taxels(&self) -> usize {
        self.map.values().len()
    }

    fn segment(&mut self, _time_s: f64) -> Segment<'_> {
        Segment { fours: self.fours.as_deref(), ..held(f64::INFINITY, &self.map) }
    }
}

/// `map` up to `end_s`.
fn held(end_s: f64, map: &ConductanceMap) -> Segment<'_> {
    Segment { start_s: 0.0, end_s, conductance_s: map.values(), end_conductance_s: None, fours: None }
}

/// Maps at given times with linear interpolation; constant before the first and after the last map.
///
/// ```
/// use spts_circuit::Interpolated;
/// use spts_models::ConductanceMap;
///
/// let map = |value_s| ConductanceMap::from_values(1, 2, vec![value_s; 2]);
/// let press = Interpolated::new(vec![0.0, 0.1], vec![map(0.0), map(2e-4)])?;
/// assert!((press.at(0.05).values()[0] - 1e-4).abs() < 1e-16);
/// assert_eq!(press.at(9.0), map(2e-4), "held after the last map");
/// # Ok::<(), spts_input::Refusal>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Interpolated {
    times_s: Vec<f64>,
    maps: Vec<ConductanceMap>,
    /// Segment of the last requested time: between the maps `segment` and `segment + 1`.
    segment: usize,
}

impl Interpolated {
    /// A source through `maps[k]` at `times_s[k]`.
    ///
    /// # Errors
    /// [`Refusal`] for an empty series, different lengths or shapes, times that do not increase, or conductances
    /// outside [0, 1e12] S.
    pub fn new(times_s: Vec<f64>, maps: Vec<ConductanceMap>) -> Result<Self, Refusal> {
        if times_s.len() != maps.len() {
            let (times, maps) = (times_s.len(), maps.len());
            return Err(Refusal::new(format!("{times} times for {maps} maps")));
        }
        let taxels = maps.first().map_or(0, |m| m.values().len());
        if taxels == 0 {
            return Err(empty());
        }
        for (index, map) in maps.iter().enumerate() {
            check(index, map, taxels)?;
            let time_s = times_s[index];
            if !time_s.is_finite() || (index > 0 && time_s <= times_s[index - 1]) {
                let needed = "not finite and after the time before it";
                return Err(Refusal::new(format!("time {index} is {time_s} s, {needed}")));
            }
        }
        Ok(Self { times_s, maps, segment: 0 })
    }

    /// The maps, in order of time.
    pub fn maps(&self) -> &[ConductanceMap] {
        &self.maps
    }

    /// Conductance at `time_s`.
    pub fn at(&self, time_s: f64) -> ConductanceMap {
        let after = self.times_s.partition_point(|t| *t <= time_s);
        let (first, second) = (after.saturating_sub(1), after.min(self.maps.len() - 1));
        let mut map = self.maps[first].clone();
        if first < second && time_s > self.times_s[first] {
            let share = (time_s - self.times_s[first]) / (self.times_s[second] - self.times_s[first]);
            for (from, to) in map.values_mut().iter_mut().zip(self.maps[second].values()) {
                *from += share * (to - *from);
            }
        }
        map
    }

    /// This source with its time shifted: time 0 of the result is the time `start_s` of this source, s.
    pub fn starting_at(&mut self, start_s: f64) -> Started<'_> {
        Started { source: self, start_s }
    }
}

/// A source shifted in time ([`Interpolated::starting_at`]).
#[derive(Debug)]
pub struct Started<'a> {
    source: &'a mut Interpolated,
    start_s: f64,
}

impl ConductanceSource for Started<'_> {
    fn taxels(&self) -> usize {
        self.source.taxels()
    }

    fn segment(&mut self, time_s: f64) -> Segment<'_> {
        let start_s = self.start_s;
        let mut segment = self.source.segment(time_s + start_s);
        segment.start_s -= start_s;
        segment.end_s -= start_s;
        // a rounding must not end the segment before the time that it holds
        segment.end_s = segment.end_s.max(time_s.next_up());
        segment
    }
}

impl ConductanceSource for Interpolated {
    fn taxels(&self) -> usize {
        self.maps[0].values().len()
    }

    fn segment(&mut self, time_s: f64) -> Segment<'_> {
        let last = self.times_s.len() - 1;
        if time_s >= self.times_s[last] {
            return held(f64::INFINITY, &self.maps[last]);
        }
        if time_s < self.times_s[0] {
            return held(self.times_s[0], &self.maps[0]);
        }
        if time_s < self.times_s[self.segment] {
            self.segment = 0;
        }
        while self.times_s[self.segment + 1] <= time_s {
            self.segment += 1;
        }
        let k = self.segment;
        Segment {
            start_s: self.times_s[k],
            end_s: self.times_s[k + 1],
            conductance_s: self.maps[k].values(),
            end_conductance_s: Some(self.maps[k + 1].values()),
            fours: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn map(a: f64, b: f64) -> ConductanceMap {
        ConductanceMap::from_values(1, 2, vec![a, b])
    }

    #[test]
    fn a_straight_line_is_reproduced_and_ends_are_held() {
        let times_s = vec![0.0, 0.5, 2.0];
        let line = |t: f64| map(1.0 + 2.0 * t, 3.0 - t);
        let mut source = Interpolated::new(times_s.clone(), times_s.iter().map(|t| line(*t)).collect()).unwrap();
        // backwards once as well: the cursor must find its way
        for t in [-1.0, 0.0, 0.25, 0.5, 0.75, 1.99, 2.0, 7.0, 0.1] {
            let segment = source.segment(t);
            segment.check(t, 2).unwrap();
            let out: [f64; 2] = std::array::from_fn(|k| {
                let from = segment.conductance_s[k];
                segment.end_conductance_s.map_or(from, |to| {
                    let share = (t - segment.start_s) / (segment.end_s - segment.start_s);
                    (1.0 - share) * from + share * to[k]
                })
            });
            let expected = line(f64::clamp(t, 0.0, 2.0));
            // two roundings of values of order 5
            assert_relative_eq!(out[0], expected.values()[0], epsilon = 10.0 * f64::EPSILON);
            assert_relative_eq!(out[1], expected.values()[1], epsilon = 10.0 * f64::EPSILON);
        }
    }

    /// A line that begins later is the line at later times: two roundings of values of order 5.
    #[test]
    fn a_source_may_begin_at_any_time() {
        let times_s = vec![0.0, 0.5, 2.0];
        let line = |t: f64| map(1.0 + 2.0 * t, 3.0 - t);
        let mut source = Interpolated::new(times_s.clone(), times_s.iter().map(|t| line(*t)).collect()).unwrap();
        for start_s in [-0.3, 0.0, 0.1, 0.5, 1.7, 5.0] {
            for t in [0.0, 0.2, 0.4, 1.0, 3.0] {
                let expected = line(f64::clamp(start_s + t, 0.0, 2.0));
                let mut later = source.starting_at(start_s);
                let segment = later.segment(t);
                segment.check(t, 2).unwrap();
                let from = segment.conductance_s[0];
                let found = segment.end_conductance_s.map_or(from, |to| {
                    from + (to[0] - from) * (t - segment.start_s) / (segment.end_s - segment.start_s)
                });
                assert_relative_eq!(found, expected.values()[0], epsilon = 20.0 * f64::EPSILON);
                let direct = source.at(start_s + t);
                assert_relative_eq!(direct.values()[1], expected.values()[1], epsilon = 20.0 * f64::EPSILON);
            }
        }
    }

    #[test]
    fn bad_series_are_refused() {
        let said = |times_s: &[f64], maps: Vec<ConductanceMap>| {
            Interpolated::new(times_s.to_vec(), maps).unwrap_err().to_string()
        };
        let twice = || vec![map(0.0, 0.0), map(1.0, 1.0)];
        assert!(said(&[], vec![]).contains("at least one map"));
        assert_eq!(said(&[0.0], twice()), "1 times for 2 maps");
        for time_s in [0.0, f64::NAN] {
            let needed = "not finite and after the time before it";
            assert_eq!(said(&[0.0, time_s], twice()), format!("time 1 is {time_s} s, {needed}"));
        }
        for (a, b, taxel, value) in [(0.0, -1.0, 1, "-1"), (f64::NAN, 0.0, 0, "NaN")] {
            let expected = format!("map 0, taxel {taxel} has conductance {value} S, outside [0, 1e12]");
            assert_eq!(Constant::new(map(a, b)).unwrap_err().to_string(), expected);
        }
        assert!(Constant::new(map(1e300, 0.0)).is_err());
    }
}
