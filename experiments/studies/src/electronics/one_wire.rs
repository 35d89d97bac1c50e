//! The largest skin that one wire can read.

use super::error::ElectronicsError;
use super::study::ElectronicsStudy;
use spts_circuit::amplifier::{Budget, Setting};

/// Ratio of the sizes that are looked at, one after another.
const RATIO: f64 = 1.01;

impl ElectronicsStudy {
    /// The largest number of taxels, pressed as in [`ElectronicsStudy::skin`], with which nothing fails on one wire. It
    /// depends only on the electronics and that pressing. `None` if something fails with any number.
    ///
    /// More taxels are not always worse: with a capacitance on the bus, their conductance damps the ringing. Therefore
    /// all sizes are tried in steps of 1 %, and the interval between the largest that works and the next is bisected. A
    /// range of working sizes that is narrower than a step may be missed.
    ///
    /// ```
    /// use spts_studies::electronics::ElectronicsStudy;
    ///
    /// let designed = ElectronicsStudy::as_designed()?;
    /// let largest = designed.largest_on_one_wire()?.expect("small skins work");
    /// // the amplifier reads that many without a remedy, and not one more
    /// assert!(designed.of(largest)?[0].budget.limit.is_none());
    /// assert!(designed.of(largest + 1)?[0].budget.limit.is_some());
    /// # Ok::<(), spts_studies::electronics::ElectronicsError>(())
    /// ```
    ///
    /// # Errors
    /// As [`ElectronicsStudy::of`].
    pub fn largest_on_one_wire(&self) -> Result<Option<u32>, ElectronicsError> {
        self.skin.validate()?;
        let setting = Setting {
            skin: self.skin,
            adc: self.adc,
            available_s: self.available_s()?,
        };
        // a bus of too large a capacitance is none
        let works = |taxels: u32| {
            let amplifier = self.amplifier(taxels);
            amplifier.is_ok_and(|a| Budget::new(&a, f64::from(taxels), &setting).limit.is_none())
        };
        let mut sizes = vec![1_u32];
        while let Some(next) = next_size(*sizes.last().unwrap_or(&1)) {
            sizes.push(next);
        }
        let Some(at) = sizes.iter().rposition(|taxels| works(*taxels)) else {
            return Ok(None);
        };
        let (mut most, mut too_many) = (sizes[at], sizes.get(at + 1).copied().unwrap_or(sizes[at]));
        while too_many > most + 1 {
            let middle = most + (too_many - most) / 2;
            if works(middle) {
                most = middle;
            } else {
                too_many = middle;
            }
        }
        Ok(Some(most))
    }

    /// Describes the result of [`ElectronicsStudy::largest_on_one_wire`].
    #[must_use]
    pub fn one_wire_text(&self, taxels: Option<u32>) -> String {
        let pressing = format!(
            "{:.4} % of them pressed to {:.4} µS, the others at {:.4} µS",
            100.0 * self.skin.pressed_share,
            self.skin.pressed_s * 1e6,
            self.skin.idle_s * 1e6
        );
        match taxels {
            Some(taxels) => format!("one wire works up to {taxels} taxels, {}", shortened(&pressing)),
            None => format!("one wire works with no number of taxels, {}", shortened(&pressing)),
        }
    }
}

/// The next size after `taxels`; `None` at the end.
fn next_size(taxels: u32) -> Option<u32> {
    #[expect(clippy::cast_possible_truncation, reason = "float to integer casts saturate")]
    let next = (f64::from(taxels) * RATIO).ceil() as u32;
    (next > taxels).then_some(next)
}

/// `text` without the zeros that end a number.
fn shortened(text: &str) -> String {
    let word = |word: &str| {
        if word.parse::<f64>().is_ok() && word.contains('.') {
            word.trim_end_matches('0').trim_end_matches('.').to_owned()
        } else {
            word.to_owned()
        }
    };
    text.split(' ').map(word).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use spts_circuit::amplifier::Skin;

    /// By hand: four standard deviations of the sum, 4 · Rf · Vd · √(N · ¼ · G²), reach the 14.9 V of the rails before
    /// anything else does. The idle taxels' part is below a ten-thousandth of it.
    #[test]
    fn the_rails_end_a_wire_as_designed() {
        let study = ElectronicsStudy::as_designed().unwrap();
        let largest = study.largest_on_one_wire().unwrap().unwrap();
        let volts = 4.0 * 1000.0 * 3.3 * 150e-6;
        let by_hand = (14.9_f64 / volts).powi(2) / 0.25;
        assert!((f64::from(largest) - by_hand).abs() <= 1.0, "{largest} {by_hand}");
        assert_eq!(
            study.one_wire_text(Some(largest)),
            format!("one wire works up to {largest} taxels, 25 % of them pressed to 150 µS, the others at 1 µS")
        );
    }

    #[test]
    fn there_may_be_none() {
        let study = ElectronicsStudy {
            skin: Skin {
                pressed_s: 1e-9,
                ..Skin::default()
            },
            ..ElectronicsStudy::as_designed().unwrap()
        };
        // a taxel is far below a step of the converter, whatever the size
        assert_eq!(study.largest_on_one_wire().unwrap(), None);
    }
}
