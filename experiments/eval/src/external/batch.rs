//! A program that runs for every press and M, on files.

use super::{answer, in_file};
use crate::algorithm::{Algorithm, Answer, DecodeError, ExternalError};
use crate::npz::{self, NpzArray};
use crate::windows::Window;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Numbers the exchange files, so that threads do not share one.
static NEXT: AtomicUsize = AtomicUsize::new(0);

pub(super) struct Files<'a> {
    command: &'a str,
    folder: &'a Path,
    taxels: usize,
}

impl<'a> Files<'a> {
    pub(super) fn new(command: &'a str, folder: &'a Path, taxels: usize) -> Self {
        Self {
            command,
            folder,
            taxels,
        }
    }

    fn run(&self, windows: &[Window<'_>]) -> Result<Vec<Answer>, ExternalError> {
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let [asked, answered] = ["windows", "answers"].map(|name| self.folder.join(format!("{name}-{number}.npz")));
        write_windows(&asked, windows)?;
        let command = self
            .command
            .replace("{windows}", &asked.display().to_string())
            .replace("{answers}", &answered.display().to_string());
        let status = Command::new("sh")
            .args(["-c", &command])
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .status()
            .map_err(|source| ExternalError::Pipe {
                command: command.clone(),
                source,
            })?;
        if !status.success() {
            return Err(ExternalError::Ended {
                command,
                status: status.to_string(),
            });
        }
        let answers = self.read_answers(&command, &answered, windows.len());
        for path in [asked, answered] {
            // the folder goes at the end in any case
            let _ = std::fs::remove_file(path);
        }
        answers
    }

    fn read_answers(&self, command: &str, path: &Path, windows: usize) -> Result<Vec<Answer>, ExternalError> {
        let images = npz::read(path, "images", windows * self.taxels).map_err(|source| in_file(path, source))?;
        let labels = npz::read(path, "labels", windows).map_err(|source| in_file(path, source))?;
        let fits = |values: &Option<Vec<f64>>, each| values.as_ref().is_none_or(|v| v.len() == windows * each);
        if !fits(&images, self.taxels) || !fits(&labels, 1) {
            return Err(ExternalError::Answer {
                command: command.to_owned(),
                problem: format!(
                    "{} numbers in `images` and {} in `labels`; {windows} windows need {} and {windows}",
                    images.as_ref().map_or(0, Vec::len),
                    labels.as_ref().map_or(0, Vec::len),
                    windows * self.taxels
                ),
            });
        }
        (0..windows)
            .map(|w| {
                let image = images.as_ref().map(|v| v[w * self.taxels..][..self.taxels].to_vec());
                let label = labels.as_ref().map(|v| as_label(v[w]));
                answer(command, self.taxels, image, label)
            })
            .collect()
    }
}

/// A whole number from 0 on is a label; anything else is unknown.
#[expect(clippy::cast_possible_truncation, reason = "checked to be a small whole number")]
fn as_label(value: f64) -> Option<usize> {
    ((0.0..1e9).contains(&value) && value.fract() == 0.0).then_some(value as usize)
}

fn write_windows(path: &Path, windows: &[Window<'_>]) -> Result<(), ExternalError> {
    let m = windows.first().map_or(0, |w| w.y.len());
    let taxels = windows.first().map_or(0, |w| w.phi.ncols());
    let weights: Vec<f64> = windows.iter().flat_map(|w| w.phi.values().iter().copied()).collect();
    #[expect(clippy::cast_possible_truncation, reason = "only used where weights are ±1")]
    let signs: Vec<i8> = weights.iter().map(|w| *w as i8).collect();
    let shape = [windows.len(), m, taxels];
    let phi = if windows.iter().all(|w| w.signs.is_some()) {
        NpzArray::Signs(&shape, &signs)
    } else {
        NpzArray::Doubles(&shape, &weights)
    };
    let all = |of: fn(&Window<'_>) -> Vec<f64>| -> Vec<f64> { windows.iter().flat_map(of).collect() };
    let (y, volts) = (all(|w| w.y.to_vec()), all(|w| w.volts.to_vec()));
    npz::write(
        path,
        &[
            ("phi", phi),
            ("y", NpzArray::Doubles(&[windows.len(), m], &y)),
            ("volts", NpzArray::Doubles(&[windows.len(), m], &volts)),
        ],
    )
    .map_err(|source| in_file(path, source))
}

impl Algorithm for Files<'_> {
    fn decode(&mut self, window: &Window<'_>, answer: &mut Answer) -> Result<(), DecodeError> {
        *answer = self.run(&[*window])?.pop().unwrap_or_default();
        Ok(())
    }

    fn batched(&self) -> bool {
        true
    }

    fn decode_all(&mut self, windows: &[Window<'_>]) -> Result<Vec<Answer>, DecodeError> {
        if windows.is_empty() {
            return Ok(Vec::new());
        }
        Ok(self.run(windows)?)
    }
}
