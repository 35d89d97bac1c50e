//! Event-driven code division: a taxel that changes sends its own signature at any time.

use super::messages::{Message, Sender, receive};
use super::readout::{PreparedReadout, Reading, ReadoutSkin, WireReadout};
use super::rows::StoredRows;
use super::wire::HeldWire;
use rand::RngExt as _;
use spts_circuit::amplifier::Skin;
use spts_input::Refusal;

/// Slots of a signature that are tried.
const SLOTS: [usize; 4] = [128, 256, 512, 1024];
/// A touched taxel sends within so many slots of the onset: a millisecond of the published clock.
pub(super) const SPREAD: usize = 64;
/// A cell sends when its taxel's conductance rises by this many times that of an idle taxel.
const EVENT: f64 = 10.0;
/// Conductance of the largest value, over that of a fully pressed taxel.
const LARGEST: f64 = 4.0;

/// Asynchronous events after ACES: each cell watches its own taxel, and when that is touched, it sends its signature of
/// sparse pulses at once, and its value behind it, a bit a signature, inverted for a zero. All transmissions overlap on
/// the wire. The receiver knows the signatures and neither who sends nor when.
///
/// After W. W. Lee et al., Science Robotics 4 (2019) eaax2198: their messages take 1 ms, and their receiver resolves
/// less than 60 ns, far less than a measurement of this wire.
#[derive(Debug, Clone, Copy)]
pub(super) struct Events;

struct Signatures {
    taxels: usize,
    /// Conductance of a cell's output, S.
    sender_s: f64,
    messages: Vec<Message>,
}

impl WireReadout for Events {
    fn prepare(&self, skin: &ReadoutSkin) -> Result<Box<dyn PreparedReadout>, Refusal> {
        let taxels = skin.layout.taxels();
        Ok(Box::new(Signatures {
            taxels,
            sender_s: Skin::default().pressed_s,
            messages: SLOTS
                .iter()
                .map(|slots| Message::new(taxels, *slots, skin.streams))
                .collect(),
        }))
    }
}

/// Value of a conductance above idle, in [0, 15]: on a scale of squares up to `largest_s`.
fn value(conductance_s: f64, largest_s: f64) -> u8 {
    let levels = f64::from(Message::LEVELS - 1);
    #[expect(clippy::cast_possible_truncation, reason = "clamped to 0..=15")]
    let value = ((conductance_s / largest_s).max(0.0).sqrt() * levels)
        .round()
        .min(levels) as u8;
    value
}

/// The middle of a value's range, S.
fn conductance_s(value: u8, largest_s: f64) -> f64 {
    let levels = f64::from(Message::LEVELS - 1);
    // the lowest value is a taxel that is touched, a little
    (f64::from(value).max(0.5) / levels).powi(2) * largest_s
}

impl PreparedReadout for Signatures {
    /// Pulses of all cells that send, in a slot where four standard deviations of them have one sign.
    fn largest_sum_s(&self, conductance_s: &[f64]) -> f64 {
        // idle taxels are the least of all
        let idle_s = conductance_s.iter().copied().fold(f64::INFINITY, f64::min);
        let senders = conductance_s.iter().filter(|g| **g > (1.0 + EVENT) * idle_s).count() as f64;
        let at_once = (4.0 * (senders * Message::DENSITY).sqrt()).max(1.0);
        at_once.min(senders.max(1.0)) * self.sender_s
    }

    fn read(&self, wire: &mut HeldWire<'_, '_>) -> Result<Vec<Reading>, Refusal> {
        let (event_s, largest_s) = (EVENT * wire.idle_s(), LARGEST * wire.pressed_s());
        let values = wire.own_values_s();
        let senders: Vec<Sender> = (0..self.taxels)
            .filter(|k| values[*k] > event_s)
            .map(|taxel| Sender {
                taxel,
                start: wire.moments().rng("start", taxel as u64).random_range(0..SPREAD),
                value: value(values[taxel], largest_s),
            })
            .collect();
        let amplitude_v = wire.pressed_s() * wire.volts_per_siemens();
        let read = |message: &Message| {
            let count = SPREAD + message.len();
            let chips = (!senders.is_empty()).then(|| StoredRows::new(senders.len(), message.chips(&senders, count)));
            let frame = wire.transmissions(chips.as_ref(), count)?;
            let samples: Vec<f64> = frame.volts.iter().map(|v| v / amplitude_v).collect();
            let mut image = vec![0.0; self.taxels];
            let found = receive(message, SPREAD, &samples);
            for sender in &found {
                image[sender.taxel] = conductance_s(sender.value, largest_s);
            }
            let noticed = frame.volts.iter().position(|v| v.abs() > frame.alarm_v);
            Ok(Reading {
                measurements: count,
                image,
                noticed: noticed.map(|first| first as f64 + 0.5),
                placed: (!found.is_empty()).then_some((SPREAD + message.slots()) as f64 - 0.5),
            })
        };
        self.messages.iter().map(read).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_coded_to_half_a_step() {
        let largest_s = 600e-6;
        for g in [10e-6_f64, 50e-6, 150e-6, 400e-6, 600e-6] {
            let (root, back) = (
                (g / largest_s).sqrt(),
                (conductance_s(value(g, largest_s), largest_s) / largest_s).sqrt(),
            );
            assert!(
                (root - back).abs() <= 0.5 / 15.0 + 1e-12,
                "{g} S: {root} against {back}"
            );
        }
        assert_eq!((value(0.0, largest_s), value(1.0, largest_s)), (0, 15));
    }
}
