//! Both ends of the serial protocol.

use spts_circuit::Mode;
use spts_input::Refusal;
use std::io::{self, Read, Write};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// What wakes the device.
const START: u8 = b'*';
/// Its first answer.
const SENDING: &str = "Sending.";
/// Its answer when the cells are loaded.
const SENT: &str = "Sent!.";

/// One block of samples as the device sends it over the serial port.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DeviceBlock {
    /// Frames since the seeds were loaded, at the end of the block.
    pub frame_position: u64,
    /// Codes of the converter, in order of measurement.
    pub codes: Vec<u32>,
}

/// Where a virtual device gets its blocks from: a simulated press, or a recording.
///
/// ```
/// use spts::{Mode, Refusal};
/// use spts::device::{BlockSource, DeviceBlock};
///
/// /// Two blocks of the same codes.
/// struct Twice(u64);
///
/// impl BlockSource for Twice {
///     fn mode(&self) -> Mode {
///         Mode::Compressive
///     }
///     fn sample_rate_hz(&self) -> f64 {
///         64_300.0
///     }
///     fn next_block(&mut self) -> Result<Option<DeviceBlock>, Refusal> {
///         self.0 += 1;
///         Ok((self.0 <= 2).then(|| DeviceBlock { frame_position: self.0, codes: vec![512; 100] }))
///     }
/// }
/// let mut source = Twice(0);
/// assert_eq!(std::iter::from_fn(|| source.next_block().ok().flatten()).count(), 2);
/// ```
pub trait BlockSource {
    /// Mode of the readout.
    fn mode(&self) -> Mode;

    /// Measurements a second, Hz.
    fn sample_rate_hz(&self) -> f64;

    /// The next block; `None` after the last.
    ///
    /// # Errors
    /// [`Refusal`] if the block cannot be made.
    fn next_block(&mut self) -> Result<Option<DeviceBlock>, Refusal>;
}

/// A stand-in for the skin's hardware that speaks the published serial protocol on a port.
pub struct VirtualDevice<P> {
    port: P,
    real_time: bool,
}

/// Time from the touch to the beginning of the recording, s.
fn wait_s(mode: Mode) -> f64 {
    match mode {
        Mode::Raster => 1.3,
        Mode::Compressive => 1.4,
    }
}

/// Time in which the cells are loaded, s: a hundred of them, one after the other, over the bus.
const LOADING_S: f64 = 0.1;

impl<P: Read + Write> VirtualDevice<P> {
    /// A device on `port`. If `real_time`, it sends at the rate of the real device; otherwise as fast as the host
    /// reads.
    pub fn new(port: P, real_time: bool) -> Self {
        Self { port, real_time }
    }

    /// Waits for the host, then sends all blocks of `source`. Calls `sent` after each. Returns the number of blocks.
    ///
    /// # Errors
    /// [`Refusal`] if the port or the source fails.
    pub fn serve(&mut self, source: &mut dyn BlockSource, mut sent: impl FnMut(u64)) -> Result<u64, Refusal> {
        let mut byte = [0];
        while byte[0] != START {
            self.port.read_exact(&mut byte).map_err(of_port)?;
        }
        writeln!(self.port, "{SENDING}").map_err(of_port)?;
        self.pause(LOADING_S);
        writeln!(self.port, "{SENT}").map_err(of_port)?;
        let mut count = 0;
        while let Some(block) = source.next_block()? {
            self.pause(wait_s(source.mode()) + block.codes.len() as f64 / source.sample_rate_hz());
            write_block(&mut self.port, &block).map_err(of_port)?;
            count += 1;
            sent(count);
        }
        Ok(count)
    }

    fn pause(&self, seconds: f64) {
        if self.real_time {
            sleep(Duration::from_secs_f64(seconds));
        }
    }
}

/// Writes `block` as the device sends it, and flushes: `frame_position`, then all codes but the last, each followed by
/// a comma; then a space and `\r\n`. The real device also omits the last code.
///
/// # Errors
/// The error of the port.
pub fn write_block(port: &mut impl Write, block: &DeviceBlock) -> io::Result<()> {
    let mut text = String::with_capacity(4 * block.codes.len() + 32);
    let kept = block.codes.len().saturating_sub(1);
    text.push_str(&block.frame_position.to_string());
    text.push(',');
    for code in &block.codes[..kept] {
        text.push_str(&code.to_string());
        text.push(',');
    }
    text.push_str(" \r\n");
    port.write_all(text.as_bytes())?;
    port.flush()
}

/// The error of the port.
fn of_port(error: io::Error) -> Refusal {
    Refusal::from_error(error).at("serial port")
}

/// What a host hears of a device.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Heard {
    /// A block.
    Block(HeardBlock),
    /// Why what was sent in place of a block cannot be used.
    Unusable(String),
    /// The caller has ended the listening.
    Stopped,
}

/// One block as it arrived.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct HeardBlock {
    /// Frames since the seeds were loaded, at the end of the block.
    pub frame_position: u64,
    /// Codes of the converter, in order of measurement; `None` where none arrived. The last one is never sent.
    pub codes: Vec<Option<u32>>,
    /// What was wrong with the block, in words, if samples are missing beside the last one.
    pub missing: Option<String>,
}

/// A host that reads a device.
///
/// The port has to return from a read at least every few tenths of a second, with [`io::ErrorKind::TimedOut`] when
/// nothing has come: only then does the host wake the device again, notice that it is silent, and ask whether to stop.
pub struct Host<'a, P> {
    port: P,
    /// Longest silence, and longest time until the device has answered.
    patience: Duration,
    stop: &'a dyn Fn() -> bool,
    /// What has arrived behind the last whole line.
    waiting: Vec<u8>,
    /// Whether the next line is the rest of one that was too long.
    skipped: bool,
}

/// Longest line that is read before the blocks, bytes: the rest of a block of a device that runs already.
const GREETING: usize = 1 << 20;
/// Most lines of greetings in the place of a block.
const GREETINGS: usize = 20;
/// Most characters of an answer that an error shows.
const SHOWN: usize = 40;
/// Most bytes of a field, with its comma.
const FIELD: usize = 24;
/// Most bytes that are read at once.
const PIECE: usize = 1 << 14;
/// Time after which a device that has not answered is woken again: a board resets when its port is opened, and its
/// boot loader reads what is sent meanwhile.
const AGAIN: Duration = Duration::from_secs(1);

/// What reading a line came to.
enum Line {
    Whole(String),
    /// A line longer than any that a device sends.
    TooLong,
    /// None within the time.
    None,
    Stopped,
}

impl<'a, P: Read + Write> Host<'a, P> {
    /// Wakes the device on `port`, and waits at most `patience` until its cells are loaded. The device is woken again
    /// until it answers; whatever else comes before its greeting is passed over. A device that sends blocks already is
    /// ready. Returns `None` as soon as `stop` says so.
    ///
    /// # Errors
    /// [`Refusal`] if the port fails, or the device does not answer in time.
    pub fn greet(port: P, patience: Duration, stop: &'a dyn Fn() -> bool) -> Result<Option<Self>, Refusal> {
        let mut host = Self { port, patience, stop, waiting: Vec::new(), skipped: false };
        let (mut heard, mut loading) = (String::new(), false);
        let end = Instant::now() + patience;
        let gone = |error: io::Error| ended(&error, "before its greeting");
        while Instant::now() < end {
            host.port.write_all(&[START]).and_then(|()| host.port.flush()).map_err(gone)?;
            let again = end.min(Instant::now() + AGAIN);
            loop {
                match host.line(GREETING, &|_| Instant::now() >= again).map_err(gone)? {
                    Line::Whole(line) if line.ends_with(SENDING) => loading = true,
                    Line::Whole(line) if line.ends_with(SENT) => return Ok(Some(host)),
                    // the rest of a block, as the device runs already: the next line is a whole one
                    Line::Whole(line) if is_of_block(&line) => return Ok(Some(host)),
                    Line::Whole(line) => heard = line,
                    Line::TooLong => {}
                    Line::None => break,
                    Line::Stopped => return Ok(None),
                }
            }
        }
        Err(host.silent(loading, &heard))
    }

    /// Waits for the next block of `measurements` measurements, and reads it. A code that cannot be read or is above
    /// `max_code` is missing, and so are codes that a short block lacks: they are taken to be its last ones.
    ///
    /// # Errors
    /// [`Refusal`] if the port fails, or nothing comes for longer than the host's patience.
    pub fn block(&mut self, measurements: usize, max_code: u32) -> Result<Heard, Refusal> {
        let most = measurements.saturating_add(1).saturating_mul(FIELD);
        let patience = self.patience;
        for _ in 0..GREETINGS {
            let line = match self.line(most, &|quiet| quiet >= patience).map_err(|error| ended(&error, &self.part()))? {
                Line::Whole(line) => line,
                Line::TooLong => return Ok(Heard::Unusable(format!("more than {most} bytes without a line end"))),
                Line::Stopped => return Ok(Heard::Stopped),
                Line::None => {
                    let (patience, part) = (patience.as_secs_f64(), self.part());
                    return Err(Refusal::new(format!("nothing came for {patience} s, {part}")));
                }
            };
            // a board that has reset once more
            if !line.ends_with(SENDING) && !line.ends_with(SENT) {
                return Ok(block_of(&line, measurements, max_code));
            }
        }
        Ok(Heard::Unusable("the device greets again and again".to_owned()))
    }

    /// How much of a block has arrived.
    fn part(&self) -> String {
        let fields = self.waiting.iter().filter(|byte| **byte == b',').count();
        if fields == 0 { "before its first code".to_owned() } else { format!("after {fields} fields") }
    }

    /// The error of a device that has not greeted; `heard` is its last line.
    fn silent(&self, loading: bool, heard: &str) -> Refusal {
        let rest = String::from_utf8_lossy(&self.waiting);
        let heard = if rest.is_empty() { heard } else { &rest };
        let patience = self.patience.as_secs_f64();
        if loading {
            return Refusal::new(format!("the device said {SENDING:?}, and no {SENT:?} within {patience} s"));
        }
        if heard.is_empty() {
            return Refusal::new(format!(
                "the device was silent for {patience} s: check that it has power and runs the skin's program, that it \
                 is on this port, and its speed (baud)"
            ));
        }
        let heard: String = heard.chars().take(SHOWN).collect();
        Refusal::new(format!(
            "the device said {heard:?} and no {SENDING:?} within {patience} s: check its program and its speed (baud)"
        ))
    }

    /// The next line that is not empty and at most `most` bytes long, without its end: `\n`, `\r`, or both. Waits until
    /// `is_over` says so, which is told for how long nothing has come.
    fn line(&mut self, most: usize, is_over: &dyn Fn(Duration) -> bool) -> io::Result<Line> {
        let (mut heard, mut searched) = (Instant::now(), 0);
        let mut piece = [0; PIECE];
        loop {
            if let Some(found) = self.waiting[searched..].iter().position(|byte| matches!(byte, b'\n' | b'\r')) {
                let line: Vec<u8> = self.waiting.drain(..=searched + found).collect();
                searched = 0;
                let line = String::from_utf8_lossy(&line);
                if std::mem::take(&mut self.skipped) || line.trim().is_empty() {
                    continue;
                }
                return Ok(Line::Whole(line.trim_end_matches(['\r', '\n']).to_owned()));
            }
            searched = self.waiting.len();
            if searched > most {
                self.skipped = true;
                self.waiting.clear();
                return Ok(Line::TooLong);
            }
            if (self.stop)() {
                return Ok(Line::Stopped);
            }
            if is_over(heard.elapsed()) {
                return Ok(Line::None);
            }
            match self.port.read(&mut piece) {
                Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
                Ok(count) => {
                    self.waiting.extend_from_slice(&piece[..count]);
                    // line ends alone say nothing
                    if !piece[..count].trim_ascii().is_empty() {
                        heard = Instant::now();
                    }
                }
                Err(error) => match error.kind() {
                    io::ErrorKind::Interrupted | io::ErrorKind::TimedOut | io::ErrorKind::WouldBlock => {}
                    _ => return Err(error),
                },
            }
        }
    }
}

/// Whether `line` is a block or the end of one.
fn is_of_block(line: &str) -> bool {
    line.contains(',') && line.bytes().all(|byte| byte.is_ascii_digit() || matches!(byte, b',' | b' '))
}

/// The error of a port that has failed in the middle of something.
fn ended(error: &io::Error, when: &str) -> Refusal {
    Refusal::new(format!("the device went away {when} ({error})"))
}

/// The block of `measurements` measurements that `line` is.
fn block_of(line: &str, measurements: usize, max_code: u32) -> Heard {
    let unusable = |found: &str, needed: &str| {
        let found: String = found.chars().take(SHOWN).collect();
        Heard::Unusable(format!("the device said {found:?}; {needed} was expected"))
    };
    let Some((position, codes)) = line.trim_end().split_once(',') else {
        return unusable(line, "a block: numbers with commas");
    };
    let Ok(frame_position) = position.parse() else {
        return unusable(position, "a number of frames");
    };
    let fields: Vec<&str> = codes.trim_end_matches(',').split(',').collect();
    let sent = measurements.saturating_sub(1);
    if fields.len() > sent {
        let found = fields.len();
        return Heard::Unusable(format!("{found} codes came where {sent} were expected"));
    }
    let read = |field: &&str| field.parse().ok().filter(|code| *code <= max_code);
    let mut codes: Vec<Option<u32>> = fields.iter().map(read).collect();
    let mut missing = Vec::new();
    if let Some(first) = codes.iter().position(Option::is_none) {
        let count = codes.iter().filter(|code| code.is_none()).count();
        let found: String = fields[first].chars().take(SHOWN).collect();
        missing.push(format!("{count} no code of [0, {max_code}], the first {found:?} at {first}"));
    }
    if fields.len() < sent {
        missing.push(format!("{} that did not come, taken to be the last", sent - fields.len()));
    }
    codes.resize(measurements, None);
    let missing = (!missing.is_empty()).then(|| format!("missing samples: {}", missing.join("; ")));
    Heard::Block(HeardBlock { frame_position, codes, missing })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;
    use std::rc::Rc;

    /// A port that says each of its pieces after having been silent for one read, and then is gone or silent.
    struct Says {
        pieces: Vec<Vec<u8>>,
        gone: bool,
        silent: bool,
        woken: Rc<Cell<usize>>,
    }

    impl Read for Says {
        fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
            self.silent = !self.silent;
            if self.silent || (self.pieces.is_empty() && !self.gone) {
                return Err(io::ErrorKind::TimedOut.into());
            }
            let Some(piece) = self.pieces.first_mut() else { return Ok(0) };
            let count = piece.len().min(out.len());
            out[..count].copy_from_slice(&piece[..count]);
            piece.drain(..count);
            if piece.is_empty() {
                self.pieces.remove(0);
            }
            Ok(count)
        }
    }

    impl Write for Says {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            assert_eq!(bytes, b"*");
            self.woken.set(self.woken.get() + 1);
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    const PATIENCE: Duration = Duration::from_millis(300);

    fn greeted(text: &[u8], gone: bool) -> Result<Option<Host<'static, Says>>, Refusal> {
        // in pieces of three bytes, as a slow line brings them
        let pieces = text.chunks(3).map(<[u8]>::to_vec).collect();
        Host::greet(Says { pieces, gone, silent: false, woken: Rc::default() }, PATIENCE, &|| false)
    }

    /// The first line of codes after the greeting `text`.
    fn codes_after(text: &[u8]) -> (u64, Vec<Option<u32>>) {
        let mut host = greeted(&[text, b"7,1,2, \r\n"].concat(), true).unwrap().unwrap();
        match host.block(3, 9).unwrap() {
            Heard::Block(HeardBlock { frame_position, codes, missing: None }) => (frame_position, codes),
            other => panic!("{text:?}: {other:?}"),
        }
    }

    #[test]
    fn noise_resets_and_any_line_end_are_passed_over() {
        for text in [
            &b"Sending.\r\nSent!.\r\n"[..],
            b"Sending.\nSent!.\n",
            b"Sending.\rSent!.\r",
            b"\xf0\x00\xffBoot v1.2\r\n\x1b[2JSendingSending.\r\nSent!.\r\n",
            b"Sending.\r\nSent!.\r\nSending.\r\nSent!.\r\n",
            b"Sending.\r\nBootSending.\r\nSent!.\r\n",
            // it runs already
            b"3,4,5,6,1,2, \r\n",
        ] {
            assert_eq!(codes_after(text), (7, vec![Some(1), Some(2), None]), "{:?}", String::from_utf8_lossy(text));
        }
    }

    #[test]
    fn a_device_that_does_not_greet_is_woken_again_and_then_refused() {
        for (text, said) in [
            (&b""[..], "the device was silent for 0.3 s: check that it has power"),
            (b"Hello\n", "the device said \"Hello\" and no \"Sending.\""),
            (b"Sending.\nnot yet\n", "the device said \"Sending.\", and no \"Sent!.\" within"),
        ] {
            let error = greeted(text, false).map(drop).unwrap_err().to_string();
            assert!(error.contains(said), "{error}");
        }
        let gone = greeted(b"Hello\n", true).map(drop).unwrap_err().to_string();
        assert!(gone.starts_with("the device went away before its greeting"), "{gone}");
        let woken = Rc::new(Cell::new(0));
        let quiet = || Says { pieces: Vec::new(), gone: false, silent: false, woken: Rc::clone(&woken) };
        assert!(Host::greet(quiet(), Duration::from_secs(60), &|| true).unwrap().is_none());
        woken.set(0);
        let asked = Cell::new(0);
        let stop = || {
            std::thread::sleep(AGAIN * 3 / 5);
            asked.set(asked.get() + 1);
            asked.get() == 4
        };
        assert!(Host::greet(quiet(), Duration::from_secs(60), &stop).unwrap().is_none());
        assert!((2..4).contains(&woken.get()), "woken {} times in {:?}", woken.get(), AGAIN * 12 / 5);
    }

    #[test]
    fn what_is_wrong_in_a_block_is_missing_or_unusable_and_said() {
        let heard = |text: &str| {
            let text = format!("Sending.\nSent!.\n{text}");
            greeted(text.as_bytes(), true).unwrap().unwrap().block(3, 9)
        };
        for (text, codes, reason) in [
            ("7,1,2, \r\n", [Some(1), Some(2), None], ""),
            ("7,1, \r\n", [Some(1), None, None], "1 that did not come"),
            ("7,x,2, \r\n", [None, Some(2), None], "1 no code of [0, 9], the first \"x\" at 0"),
            ("7,1,-2, \r\n", [Some(1), None, None], "the first \"-2\" at 1"),
            ("7,10,2, \r\n", [None, Some(2), None], "the first \"10\" at 0"),
            ("7, \r\n", [None, None, None], "no code"),
        ] {
            let Heard::Block(block) = heard(text).unwrap() else { panic!("{text}") };
            assert_eq!((block.frame_position, &block.codes[..]), (7, &codes[..]), "{text}");
            assert_eq!(block.missing.is_none(), reason.is_empty(), "{text}: {block:?}");
            assert!(block.missing.unwrap_or_default().contains(reason), "{text}");
        }
        for (text, reason) in [
            ("7,1,2,3, \r\n", "3 codes came where 2 were expected"),
            ("x,1,2, \r\n", "\"x\"; a number of frames"),
            ("hello\n", "\"hello\"; a block"),
            (&format!("{}\n", "7".repeat(10_000)), "more than 96 bytes"),
            (&"7".repeat(10_000), "more than 96 bytes"),
            (&"Sending.\n".repeat(1000), "greets again and again"),
        ] {
            let Heard::Unusable(said) = heard(text).unwrap() else { panic!("{text:.20}") };
            assert!(said.contains(reason), "{text:.20}: {said}");
        }
        let gone = heard("7,1,2").unwrap_err().to_string();
        assert!(gone.starts_with("the device went away after 2 fields"), "{gone}");
        let mut silent = greeted(b"Sending.\nSent!.\n", false).unwrap().unwrap();
        let silent = silent.block(3, 9).unwrap_err().to_string();
        assert!(silent.starts_with("nothing came for 0.3 s, before its first code"), "{silent}");
    }
}
