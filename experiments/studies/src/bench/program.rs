//! Programs that take part: decoders, rows of their own, and whole readouts, a line of JSON at a time.

use super::rows::RowsAndDecoder;
use super::wire::WireSession;
use super::{Entrant, Prepared, Reader, Reading, Track};
use serde::Deserialize;
use serde_json::{Value, json};
use spts_eval::algorithm::Class;
use spts_eval::decoders::TrainedDecoder;
use spts_eval::external::{External, ExternalCommand};
use spts_input::Refusal;
use spts_recon::Matrix;
use std::sync::Arc;

/// The program at work on one task of `track`.
///
/// # Errors
/// [`Refusal`] of a program that cannot be started, or whose rows are none.
pub(super) fn start(command: &ExternalCommand, track: Track, prepared: &Prepared) -> Result<Box<dyn Entrant>, Refusal> {
    let data = prepared.images()?;
    let mut more = serde_json::Map::new();
    more.insert("track".to_owned(), json!(track.name()));
    more.insert("measurements".to_owned(), json!(prepared.measurements));
    // an answer may be a row for each measurement
    let rows = prepared.measurements.iter().copied().max().filter(|_| track != Track::Decoder).unwrap_or(1);
    let values = prepared.layout.taxels() * rows;
    let program = Arc::new(command.begin(&data, &prepared.labels, None, &more, values)?);
    Ok(match track {
        Track::Decoder => {
            let decoder = TrainedDecoder::of(program, &data);
            Box::new(RowsAndDecoder::given(&prepared.weights()?, &prepared.measurements, decoder)?.in_turn())
        }
        Track::Rows => {
            let taxels = prepared.layout.taxels();
            let rows = prepared.measurements.iter().map(|&m| rows_of(&program, m, taxels));
            let rows = rows.collect::<Result<Vec<_>, Refusal>>()?;
            Box::new(RowsAndDecoder::new(rows, TrainedDecoder::of(program, &data))?.in_turn())
        }
        Track::Readout => Box::new(OwnReadout(program)),
    })
}

/// Rows of ±1 of the program for `m` measurements.
fn rows_of(program: &External, m: usize, taxels: usize) -> Result<Matrix, Refusal> {
    #[derive(Deserialize)]
    struct Answer {
        rows: Vec<String>,
    }
    let answer = program.ask(&json!({"rows": m}))?;
    let Ok(Answer { rows }) = serde_json::from_value(answer) else {
        return Err(program.refused("no `rows`: M strings of + and −, one sign a taxel"));
    };
    let signs: Option<Vec<f64>> = rows.iter().flat_map(|row| row.bytes().map(level)).collect();
    let whole = rows.len() == m && rows.iter().all(|row| row.len() == taxels && !row.contains('0'));
    match signs.filter(|_| whole) {
        Some(signs) => Matrix::from_rows(m, taxels, signs),
        None => Err(program.refused(&format!("rows that are not {m} strings of {taxels} signs, + or -"))),
    }
}

/// Level of a sign.
fn level(sign: u8) -> Option<f64> {
    match sign {
        b'+' => Some(1.0),
        b'-' => Some(-1.0),
        b'0' => Some(0.0),
        _ => None,
    }
}

/// A row of levels, as numbers or as a string of the signs +, - and 0.
#[derive(Deserialize)]
#[serde(untagged)]
enum Row {
    Signs(String),
    Levels(Vec<f64>),
}

impl Row {
    /// The levels; `None` if one of them is none, or there are not as many as taxels.
    fn levels(self, taxels: usize) -> Option<Vec<f64>> {
        let levels = match self {
            Self::Signs(signs) => signs.bytes().map(level).collect::<Option<Vec<f64>>>()?,
            Self::Levels(levels) => levels,
        };
        let sound = levels.len() == taxels && levels.iter().all(|level| (-1.0..=1.0).contains(level));
        sound.then_some(levels)
    }
}

/// A program that says what is measured next.
struct OwnReadout(Arc<External>);

impl Entrant for OwnReadout {
    fn largest_sum_s(&self, _: &[f64]) -> f64 {
        0.0
    }

    fn learns_its_sums(&self) -> bool {
        true
    }

    fn start(&self) -> Box<dyn Reader + '_> {
        Box::new(self)
    }

    fn in_turn(&self) -> bool {
        true
    }

    fn finish(&self) -> Result<(), Refusal> {
        use spts_eval::algorithm::Trained as _;
        Ok(self.0.finish()?)
    }
}

/// What the program answers: levels to be measured, a row for each measurement, or its image and class.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Step {
    #[serde(default)]
    measure: Vec<Row>,
    image: Option<Vec<f64>>,
    label: Option<usize>,
}

impl Reader for &OwnReadout {
    fn read(&mut self, wire: &mut WireSession<'_>) -> Result<Reading, Refusal> {
        let taxels = wire.skin.layout.taxels();
        let mut question = json!({"read": wire.left()});
        loop {
            let answer: Value = self.0.ask(&question)?;
            let step: Step = match serde_json::from_value(answer) {
                Ok(step) => step,
                Err(error) => return Err(self.0.refused(&error.to_string())),
            };
            if let Some(image) = step.image {
                if image.len() != taxels {
                    return Err(self.0.refused(&format!("an image of {} values; valid: {taxels}", image.len())));
                }
                return Ok(Reading { image, class: step.label.map(Class::Known), time_s: 0.0 });
            }
            let rows: Option<Vec<Vec<f64>>> = step.measure.into_iter().map(|row| row.levels(taxels)).collect();
            let Some(rows) = rows.filter(|rows| !rows.is_empty()) else {
                let problem = format!("neither an image nor rows of {taxels} levels in [-1, 1] to `measure`");
                return Err(self.0.refused(&problem));
            };
            if rows.len() > wire.left() {
                let problem = format!("{} rows to measure; {} are left", rows.len(), wire.left());
                return Err(self.0.refused(&problem));
            }
            question = json!({"y": wire.levels(&rows)?, "left": wire.left()});
        }
    }
}
