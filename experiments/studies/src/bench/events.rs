//! Event-driven code division: a taxel that changes sends its own signature at any time.

use super::wire::{NEUTRAL, WireSession};
use super::{Entrant, Reader, Reading};
use rand::RngExt as _;
use spts_circuit::Patterns;
use spts_circuit::amplifier::Skin;
use spts_input::Refusal;
use spts_models::Streams;

/// Slots of a signature at least and at most.
const SLOTS: [usize; 2] = [16, 1024];
/// A touched taxel sends within so many slots of the onset: a millisecond of the published clock.
const SPREAD: usize = 64;
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
pub(super) struct Events {
    taxels: usize,
    streams: Streams,
}

impl Events {
    pub(super) fn new(taxels: usize, streams: Streams) -> Self {
        Self { taxels, streams }
    }
}

/// Value of a conductance above idle, in [0, 15]: on a scale of squares up to `largest_s`.
fn value(conductance_s: f64, largest_s: f64) -> u8 {
    let levels = f64::from(Message::LEVELS - 1);
    #[expect(clippy::cast_possible_truncation, reason = "clamped to 0..=15")]
    let value = ((conductance_s / largest_s).max(0.0).sqrt() * levels).round().min(levels) as u8;
    value
}

/// The middle of a value's range, S.
fn conductance_s(value: u8, largest_s: f64) -> f64 {
    let levels = f64::from(Message::LEVELS - 1);
    // the lowest value is a taxel that is touched, a little
    (f64::from(value).max(0.5) / levels).powi(2) * largest_s
}

impl Entrant for Events {
    /// Pulses of all cells that send, in a slot where four standard deviations of them have one sign.
    fn largest_sum_s(&self, conductance_s: &[f64]) -> f64 {
        // idle taxels are the least of all
        let idle_s = conductance_s.iter().copied().fold(f64::INFINITY, f64::min);
        let senders = conductance_s.iter().filter(|g| **g > (1.0 + EVENT) * idle_s).count() as f64;
        let at_once = (4.0 * (senders * Message::DENSITY).sqrt()).max(1.0);
        at_once.min(senders.max(1.0)) * Skin::default().pressed_s
    }

    fn start(&self) -> Box<dyn Reader + '_> {
        Box::new(self)
    }
}

impl Reader for &Events {
    fn read(&mut self, wire: &mut WireSession<'_>) -> Result<Reading, Refusal> {
        let Skin { idle_s, pressed_s, .. } = wire.skin.electronics.skin;
        let (event_s, largest_s) = (EVENT * idle_s, LARGEST * pressed_s);
        let mut image = vec![0.0; self.taxels];
        // the longest signature that there is time for, in whole sixteens
        let slots = wire.left().saturating_sub(SPREAD) / (1 + Message::BITS) / 16 * 16;
        if slots < SLOTS[0] {
            return Ok(Reading::of(image));
        }
        let message = Message::new(self.taxels, slots.min(SLOTS[1]), self.streams);
        let values = wire.own_values_s();
        let senders: Vec<Sender> = (0..self.taxels)
            .filter(|k| values[*k] > event_s)
            .map(|taxel| Sender {
                taxel,
                start: wire.moments().rng("start", taxel as u64).random_range(0..SPREAD),
                value: value(values[taxel], largest_s),
            })
            .collect();
        let amplitude_v = pressed_s * wire.profile.volts_per_siemens();
        let count = SPREAD + message.len();
        let chips = (!senders.is_empty()).then(|| Patterns::new(count, message.chips(&senders, count)));
        let frame = wire.transmissions(chips.transpose()?.as_ref(), count)?;
        let samples: Vec<f64> = frame.volts.iter().map(|v| v / amplitude_v).collect();
        for sender in receive(&message, &samples) {
            image[sender.taxel] = conductance_s(sender.value, largest_s);
        }
        Ok(Reading::of(image))
    }
}

/// Rounds of the search, which ends when it finds nothing else.
const ROUNDS: usize = 6;
/// Steps of conjugate gradients for the amplitudes of a round.
const STEPS: usize = 40;
/// Weight of amplitudes beside their misfit: those that no sample tells apart stay small.
const RIDGE: f64 = 0.1;
/// A message counts as sent when its amplitude is more than half of what it should be.
const PRESENT: f64 = 0.5;

/// Signatures of all taxels, and how messages are made of them.
struct Message {
    slots: usize,
    /// Pulses of every taxel, slot and sign, in the order of their slots.
    signatures: Vec<Vec<(usize, f64)>>,
}

/// A transmission.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Sender {
    /// Sending taxel.
    taxel: usize,
    /// First slot of the message.
    start: usize,
    /// Value that is sent, in [0, [`Message::LEVELS`]).
    value: u8,
}

impl Message {
    /// Bits of a value.
    const BITS: usize = 4;
    /// Values.
    const LEVELS: u8 = 1 << Self::BITS;
    /// Share of the slots with a pulse.
    const DENSITY: f64 = 1.0 / 16.0;

    /// Signatures of `taxels` taxels: in every sixteen of the `slots` slots one pulse of either sign, at random.
    fn new(taxels: usize, slots: usize, streams: Streams) -> Self {
        let signature = |taxel: usize| {
            let mut rng = streams.child("bench/signatures", slots as u64).rng("taxel", taxel as u64);
            let pulse = |start: usize| {
                let slot = start + usize::from(rng.random_range(0..16_u16));
                (slot, if rng.random() { 1.0 } else { -1.0 })
            };
            (0..slots).step_by(16).map(pulse).collect()
        };
        Self { slots, signatures: (0..taxels).map(signature).collect() }
    }

    /// Slots of a message: the signature alone, then once a bit.
    fn len(&self) -> usize {
        (1 + Self::BITS) * self.slots
    }

    /// Pulses of piece `piece` of a message of `taxel` that starts at `start`: 0 is the signature, then the bits, the
    /// lowest first.
    fn pulses(&self, taxel: usize, start: usize, piece: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let first = start + piece * self.slots;
        let pulses = self.signatures[taxel].iter();
        pulses.map(move |(slot, sign)| (first + slot, *sign))
    }

    /// Codes of the senders at `count` slots, slot after slot.
    fn chips(&self, senders: &[Sender], count: usize) -> Vec<u8> {
        let mut chips = vec![NEUTRAL; count * senders.len()];
        for (k, sender) in senders.iter().enumerate() {
            for piece in 0..=Self::BITS {
                let inverted = piece > 0 && sender.value >> (piece - 1) & 1 == 0;
                for (slot, sign) in self.pulses(sender.taxel, sender.start, piece) {
                    if let Some(chip) = chips.get_mut(slot * senders.len() + k) {
                        *chip = if (sign > 0.0) == inverted { 0 } else { u8::MAX };
                    }
                }
            }
        }
        chips
    }
}

/// Who sent what in `samples`, in which a pulse has height 1, when messages start in the first [`SPREAD`] slots: a
/// subspace pursuit. As many taxels as the energy of the samples stands for join those of the round before, each at the
/// moment at which its signature correlates most; the amplitudes of all their pieces are solved for together, and those
/// stay whose signature is there.
/// Source: W. Dai, O. Milenkovic, IEEE Trans. Inf. Theory 55 (2009) 2230, with known amplitudes in place of a known
/// number.
fn receive(message: &Message, samples: &[f64]) -> Vec<Sender> {
    let pulses = message.slots as f64 * Message::DENSITY * (1 + Message::BITS) as f64;
    let energy: f64 = samples.iter().map(|v| v * v).sum();
    #[expect(clippy::cast_possible_truncation, reason = "at most the number of samples")]
    let count = ((energy / pulses).round() as usize).min(samples.len() / 16);
    let mut kept: Vec<(usize, usize)> = Vec::new();
    let (mut amplitudes, mut residual) = (Vec::new(), samples.to_vec());
    for _ in 0..ROUNDS {
        let mut tried = kept.clone();
        tried.extend(strongest(message, &residual, &kept, count));
        let solved = solve(message, &tried, samples);
        let present: Vec<usize> = (0..tried.len()).filter(|k| solved[k * PIECES] > PRESENT).collect();
        let found: Vec<(usize, usize)> = present.iter().map(|k| tried[*k]).collect();
        amplitudes = solve(message, &found, samples);
        residual.copy_from_slice(samples);
        add(message, &found, &amplitudes, -1.0, &mut residual);
        let same = found == kept;
        kept = found;
        if same {
            break;
        }
    }
    let value =
        |pieces: &[f64]| (0..Message::BITS).fold(0, |value, bit| value | u8::from(pieces[1 + bit] > 0.0) << bit);
    let mut senders: Vec<Sender> = kept
        .iter()
        .zip(amplitudes.chunks_exact(PIECES))
        .filter(|(_, pieces)| pieces[0] > PRESENT)
        .map(|((taxel, start), pieces)| Sender { taxel: *taxel, start: *start, value: value(pieces) })
        .collect();
    senders.sort_by_key(|sender| sender.taxel);
    senders
}

/// Pieces of a message.
const PIECES: usize = 1 + Message::BITS;

/// The `count` taxels, none of those `kept`, whose signatures correlate most with the residual, each at its best start.
fn strongest(message: &Message, residual: &[f64], kept: &[(usize, usize)], count: usize) -> Vec<(usize, usize)> {
    let mut best: Vec<(f64, usize, usize)> = Vec::new();
    let mut sums = [0.0; SPREAD];
    for taxel in (0..message.signatures.len()).filter(|taxel| kept.iter().all(|(k, _)| k != taxel)) {
        sums.fill(0.0);
        for (slot, sign) in message.pulses(taxel, 0, 0) {
            let window = residual.get(slot..slot + SPREAD).unwrap_or_default();
            sums.iter_mut().zip(window).for_each(|(sum, v)| *sum += sign * v);
        }
        let start = (1..SPREAD).fold(0, |a, b| if sums[b] > sums[a] { b } else { a });
        best.push((sums[start], taxel, start));
    }
    best.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    best.iter().take(count).map(|(_, taxel, start)| (*taxel, *start)).collect()
}

/// Adds `factor` times the pieces with these amplitudes to `samples`.
fn add(message: &Message, senders: &[(usize, usize)], amplitudes: &[f64], factor: f64, samples: &mut [f64]) {
    for ((taxel, start), pieces) in senders.iter().zip(amplitudes.chunks_exact(PIECES)) {
        for (piece, amplitude) in pieces.iter().enumerate() {
            for (slot, sign) in message.pulses(*taxel, *start, piece) {
                if let Some(sample) = samples.get_mut(slot) {
                    *sample += factor * amplitude * sign;
                }
            }
        }
    }
}

/// What the samples correlate with every piece.
fn correlate(message: &Message, senders: &[(usize, usize)], samples: &[f64]) -> Vec<f64> {
    let sample = |slot: usize| samples.get(slot).copied().unwrap_or(0.0);
    let sum = |(taxel, start), piece| message.pulses(taxel, start, piece).map(|(slot, sign)| sign * sample(slot)).sum();
    let each = senders.iter().flat_map(|sender| (0..PIECES).map(move |piece| (*sender, piece)));
    each.map(|(sender, piece)| sum(sender, piece)).collect()
}

/// Amplitudes of all pieces by least squares with a small ridge: conjugate gradients on the normal equations.
fn solve(message: &Message, senders: &[(usize, usize)], samples: &[f64]) -> Vec<f64> {
    let mut rest = correlate(message, senders, samples);
    let mut amplitudes = vec![0.0; rest.len()];
    let mut direction = rest.clone();
    let square = |v: &[f64]| v.iter().map(|v| v * v).sum::<f64>();
    let first = square(&rest);
    let mut before = first;
    for _ in 0..STEPS {
        if before <= 1e-16 * first {
            break;
        }
        let mut forward = vec![0.0; samples.len()];
        add(message, senders, &direction, 1.0, &mut forward);
        let mut product = correlate(message, senders, &forward);
        product.iter_mut().zip(&direction).for_each(|(p, d)| *p += RIDGE * d);
        let step = before / direction.iter().zip(&product).map(|(d, p)| d * p).sum::<f64>();
        amplitudes.iter_mut().zip(&direction).for_each(|(a, d)| *a += step * d);
        rest.iter_mut().zip(&product).for_each(|(r, p)| *r -= step * p);
        let now = square(&rest);
        direction.iter_mut().zip(&rest).for_each(|(d, r)| *d = r + now / before * *d);
        before = now;
    }
    amplitudes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_coded_to_half_a_step() {
        let largest_s = 600e-6;
        for g in [10e-6_f64, 50e-6, 150e-6, 400e-6, 600e-6] {
            let (root, back) =
                ((g / largest_s).sqrt(), (conductance_s(value(g, largest_s), largest_s) / largest_s).sqrt());
            assert!((root - back).abs() <= 0.5 / 15.0 + 1e-12, "{g} S: {root} against {back}");
        }
        assert_eq!((value(0.0, largest_s), value(1.0, largest_s)), (0, 15));
    }

    fn samples(message: &Message, senders: &[Sender], count: usize) -> Vec<f64> {
        let chips = message.chips(senders, count);
        let level = |code: &u8| match *code {
            NEUTRAL => 0.0,
            code => f64::from(code) / 127.5 - 1.0,
        };
        let slots = chips.chunks(senders.len().max(1));
        let mut samples: Vec<f64> = slots.map(|s| s.iter().map(level).sum()).collect();
        samples.resize(count, 0.0);
        samples
    }

    /// Twenty of a thousand, at moments of their own, in signatures of 512 slots: far above what 20 unknown taxels and
    /// moments need, 2 · 20 · ln(1000 · 64/20) = 323 slots.
    #[test]
    fn overlapping_messages_are_told_apart() {
        let message = Message::new(1000, 512, Streams::new(3));
        let senders: Vec<Sender> = (0..20_u8)
            .map(|k| Sender { taxel: 47 * usize::from(k) + 3, start: usize::from(k) * 29 % 64, value: k % 16 })
            .collect();
        let mut heard = samples(&message, &senders, 64 + message.len());
        assert_eq!(receive(&message, &heard), senders);
        // and through noise of a fifth of a pulse
        let mut rng = Streams::new(4).rng("noise", 0);
        heard.iter_mut().for_each(|v| *v += 0.35 * rng.random_range(-1.0..1.0));
        assert_eq!(receive(&message, &heard), senders);
    }

    #[test]
    fn silence_is_nobody() {
        let message = Message::new(100, 128, Streams::new(3));
        assert_eq!(receive(&message, &vec![0.0; 64 + message.len()]), []);
        let mut rng = Streams::new(4).rng("noise", 0);
        let noise: Vec<f64> = (0..64 + message.len()).map(|_| 0.2 * rng.random_range(-1.0..1.0)).collect();
        assert_eq!(receive(&message, &noise), []);
    }
}
