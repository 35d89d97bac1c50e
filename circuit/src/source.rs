//! Conductance of the skin as a function of time.

use spts_models::ConductanceMap;

/// Conductance of every taxel at any time of a block.
pub trait ConductanceSource {
    /// Number of taxels.
    fn taxels(&self) -> usize;

    /// Writes the conductance of every taxel, S, at `time_s` seconds after the start of the block. The readout asks for
    /// times in increasing order.
    fn sample(&mut self, time_s: f64, out: &mut [f64]);
}

/// A series that is not one.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SourceError {
    /// No map, or a map without taxels.
    #[error("a conductance series needs at least one map with at least one taxel")]
    Empty,
    /// Different numbers of times and maps.
    #[error("{times} times for {maps} maps")]
    Length {
        /// Number of times.
        times: usize,
        /// Number of maps.
        maps: usize,
    },
    /// A map of another shape than the first one.
    #[error("map {index} has {taxels} taxels; expected {expected}")]
    Shape {
        /// 0-based map.
        index: usize,
        /// Its taxels.
        taxels: usize,
        /// Taxels of the first map.
        expected: usize,
    },
    /// A time that is not after the one before it, or not finite.
    #[error("time {index} is {time_s} s, not finite and after the time before it")]
    Time {
        /// 0-based map.
        index: usize,
        /// Its time, s.
        time_s: f64,
    },
    /// A conductance that is negative or not finite.
    #[error("map {index}, taxel {taxel} has conductance {value_s} S, outside [0, ∞)")]
    Conductance {
        /// 0-based map.
        index: usize,
        /// 0-based taxel.
        taxel: usize,
        /// Offending value, S.
        value_s: f64,
    },
}

fn check(index: usize, map: &ConductanceMap, expected: usize) -> Result<(), SourceError> {
    let values = map.values();
    if values.len() != expected {
        return Err(SourceError::Shape {
            index,
            taxels: values.len(),
            expected,
        });
    }
    match values.iter().position(|g| !(*g >= 0.0 && g.is_finite())) {
        None => Ok(()),
        Some(taxel) => Err(SourceError::Conductance {
            index,
            taxel,
            value_s: values[taxel],
        }),
    }
}

/// The same conductance for ever.
#[derive(Debug, Clone)]
pub struct Constant {
    map: ConductanceMap,
}

impl Constant {
    /// Source of `map`.
    ///
    /// # Errors
    /// [`SourceError`] for an empty map and for a conductance that is negative or not finite.
    pub fn new(map: ConductanceMap) -> Result<Self, SourceError> {
        if map.values().is_empty() {
            return Err(SourceError::Empty);
        }
        check(0, &map, map.values().len())?;
        Ok(Self { map })
    }
}

impl ConductanceSource for Constant {
    fn taxels(&self) -> usize {
        self.map.values().len()
    }

    fn sample(&mut self, _time_s: f64, out: &mut [f64]) {
        out.copy_from_slice(self.map.values());
    }
}

/// Maps at given times, joined by straight lines; before the first and after the last one they are held.
#[derive(Debug, Clone)]
pub struct Interpolated {
    times_s: Vec<f64>,
    maps: Vec<ConductanceMap>,
    /// Segment that held the last time asked for: between knots `segment` and `segment + 1`.
    segment: usize,
    /// Slopes of that segment, S/s.
    slopes: Vec<f64>,
}

impl Interpolated {
    /// Source through `maps[k]` at `times_s[k]`.
    ///
    /// # Errors
    /// [`SourceError`] for an empty series, different lengths or shapes, times that do not increase, and conductances
    /// that are negative or not finite.
    pub fn new(times_s: Vec<f64>, maps: Vec<ConductanceMap>) -> Result<Self, SourceError> {
        if times_s.len() != maps.len() {
            return Err(SourceError::Length {
                times: times_s.len(),
                maps: maps.len(),
            });
        }
        let taxels = maps.first().map_or(0, |m| m.values().len());
        if taxels == 0 {
            return Err(SourceError::Empty);
        }
        for (index, map) in maps.iter().enumerate() {
            check(index, map, taxels)?;
            let time_s = times_s[index];
            if !time_s.is_finite() || (index > 0 && time_s <= times_s[index - 1]) {
                return Err(SourceError::Time { index, time_s });
            }
        }
        let mut source = Self {
            times_s,
            maps,
            segment: 0,
            slopes: vec![0.0; taxels],
        };
        source.enter(0);
        Ok(source)
    }

    fn enter(&mut self, segment: usize) {
        self.segment = segment;
        if let [a, b] = &self.maps[segment..(segment + 2).min(self.maps.len())] {
            let dt_s = self.times_s[segment + 1] - self.times_s[segment];
            for ((slope, a), b) in self.slopes.iter_mut().zip(a.values()).zip(b.values()) {
                *slope = (b - a) / dt_s;
            }
        }
    }
}

impl ConductanceSource for Interpolated {
    fn taxels(&self) -> usize {
        self.slopes.len()
    }

    fn sample(&mut self, time_s: f64, out: &mut [f64]) {
        let last = self.times_s.len() - 1;
        if time_s >= self.times_s[last] {
            out.copy_from_slice(self.maps[last].values());
            return;
        }
        if time_s <= self.times_s[0] {
            out.copy_from_slice(self.maps[0].values());
            return;
        }
        let mut segment = if time_s < self.times_s[self.segment] {
            0
        } else {
            self.segment
        };
        while self.times_s[segment + 1] <= time_s {
            segment += 1;
        }
        if segment != self.segment {
            self.enter(segment);
        }
        let dt_s = time_s - self.times_s[segment];
        for ((out, a), slope) in out.iter_mut().zip(self.maps[segment].values()).zip(&self.slopes) {
            *out = a + slope * dt_s;
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
        let mut out = [0.0; 2];
        // backwards once as well: the cursor must find its way
        for t in [-1.0, 0.0, 0.25, 0.5, 0.75, 1.99, 2.0, 7.0, 0.1] {
            source.sample(t, &mut out);
            let expected = line(f64::clamp(t, 0.0, 2.0));
            // two roundings of values of order 5
            assert_relative_eq!(out[0], expected.values()[0], epsilon = 10.0 * f64::EPSILON);
            assert_relative_eq!(out[1], expected.values()[1], epsilon = 10.0 * f64::EPSILON);
        }
    }

    #[test]
    fn bad_series_are_refused() {
        assert_eq!(Interpolated::new(vec![], vec![]).unwrap_err(), SourceError::Empty);
        let twice = || vec![map(0.0, 0.0), map(1.0, 1.0)];
        assert!(matches!(
            Interpolated::new(vec![0.0], twice()),
            Err(SourceError::Length { .. })
        ));
        assert!(matches!(
            Interpolated::new(vec![0.0, 0.0], twice()),
            Err(SourceError::Time { index: 1, .. })
        ));
        assert!(matches!(
            Interpolated::new(vec![0.0, f64::NAN], twice()),
            Err(SourceError::Time { index: 1, .. })
        ));
        assert!(matches!(
            Constant::new(map(0.0, -1.0)),
            Err(SourceError::Conductance { taxel: 1, .. })
        ));
        assert!(matches!(
            Constant::new(map(f64::NAN, 0.0)),
            Err(SourceError::Conductance { taxel: 0, .. })
        ));
    }
}
